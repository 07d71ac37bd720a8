//! One function per subcommand. It calls the library and prints the result.

mod devices;
mod help;
mod look;
mod plan_table;
mod simulate;
mod sweep;
mod tune;

use cutis::volume::ReadOptions;
use cutis::{Error, report::Report, scene};

use crate::args::{Command, SceneCommand};
use crate::terminal::print;

/// Runs a subcommand. Returns the exit code.
pub(crate) fn run(command: Command) -> Result<u8, Error> {
    let done = match command {
        Command::Sweep { study, args } => return sweep::sweep(&study, &args),
        Command::Demo { out, change, json } => simulate::demo(&out, &change, json),
        Command::Run(args) => simulate::run(args),
        Command::Settle(args) => simulate::settle(args),
        Command::Check { scene, change, lattice, json } => simulate::check(&scene, &change, lattice, json),
        Command::Tune { scene, tune: args, change, json } => tune::tune(&scene, &change, &args, json),
        Command::Resample { scene, run, input, out, change } => {
            simulate::resample(&scene, &change, cutis::ResampleRequest { run, input: input.input(), out })
        }
        Command::Inspect { volume, json } => look::inspect(&volume, json),
        Command::Convert { volume, out } => look::convert(&volume, &out),
        Command::Skin { volume, lattice, mode, split, offset_hu, out, json } => {
            look::skin(&volume, lattice, mode, split, offset_hu, out.as_deref(), json)
        }
        Command::Phantom { size, seed, turn_deg, out } => look::phantom(size, seed, &turn_deg, &out),
        Command::Render { volume, out, side, slice, window, focus, zoom, pixels } => {
            look::render(&volume, &out, &look::Look { side, slice, window, focus, zoom, pixels })
        }
        Command::Devices { json } => {
            let found = cutis::devices();
            print(&if json { pretty(&found) } else { devices::table(&found) });
            Ok(())
        }
        Command::Completions { shell } => {
            help::completions(shell);
            Ok(())
        }
        Command::Man { folder: Some(folder), .. } => help::man(&folder),
        Command::Man { folder: None, .. } => {
            print(help::markdown().trim_end());
            Ok(())
        }
        Command::Scene { what } => {
            match what {
                SceneCommand::New { volume: None, .. } => print(scene::template().trim_end()),
                SceneCommand::New { volume: Some(path), series, resample } => {
                    let options = ReadOptions { series, resample };
                    print(scene::template_for(&path, &options)?.trim_end());
                }
                SceneCommand::Schema => print(&pretty(&scene::schema())),
                SceneCommand::Reference => print(scene::reference().trim_end()),
                SceneCommand::StudySchema => print(&pretty(&cutis::sweep::Study::json_schema())),
                SceneCommand::ReportSchema => print(&pretty(&Report::json_schema())),
            }
            Ok(())
        }
    };
    done.map(|()| 0)
}

/// Indented JSON. Serializing plain data cannot fail.
fn pretty(value: &impl serde::Serialize) -> String {
    serde_json::to_string_pretty(value).unwrap_or_else(|e| format!("{{\"error\": \"{e}\"}}"))
}
