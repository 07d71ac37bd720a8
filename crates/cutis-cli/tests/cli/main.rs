//! The program as users and scripts see it: exit codes, messages, JSON, and complete files or none.

mod convert;
mod disk;
mod exit_codes;
#[cfg(feature = "gpu")]
mod gpu;
mod help;
#[cfg(unix)]
mod interrupt;
mod json;
#[cfg(unix)]
mod killed;
mod looks;
mod paper_form;
mod printed;
mod run_folder;
mod slicer;
mod steps;
mod sweep;
mod tune;

use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;

/// The program under test.
const PROGRAM: &str = env!("CARGO_BIN_EXE_cutis");

/// A torso of a few thousand vertices with an incision, without pictures, which take most of the
/// time. A run takes a fraction of a second.
const SCENE: &str = r#"
scan_is_at_rest = false
incision = [{ from_mm = [30, 110, -50], to_mm = [30, 110, 50], depth_mm = 20.0, width_mm = 10.0 }]
[volume]
phantom = { size = [48, 48, 36], seed = 1 }
[lattice]
spacing_mm = 12.0
[constraints]
distance = { youngs_modulus_pa = 5.0e3 }
volume = { bulk_modulus_pa = 5.0e4 }
stc = { area_modulus_n_per_m = 100.0, rest_area_scale = 0.8 }
[fixed]
bone_above_hu = 250.0
end_layers = ["k"]
[solver]
formulation = "xpbd"
[run]
frames = 2
[output]
report = true
surface = true
volume = true
"#;

/// A temporary folder with `scene.toml`, in which the program runs.
struct Desk {
    folder: TempDir,
}

/// Exit code and output of a call of the program.
struct Done {
    call: String,
    code: i32,
    stdout: String,
    stderr: String,
}

impl Desk {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// Sorted names of the files of a folder. Empty if the folder does not exist.
    fn names(&self, folder: &str) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(self.path(folder)) else { return Vec::new() };
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Runs the program in the folder.
    fn cutis(&self, args: &[&str]) -> Done {
        self.finish(args, Command::new(PROGRAM).args(args))
    }

    /// Runs the program in the folder with additional environment variables.
    #[cfg(feature = "gpu")]
    fn cutis_with(&self, variables: &[(&str, &str)], args: &[&str]) -> Done {
        self.finish(args, Command::new(PROGRAM).args(args).envs(variables.iter().copied()))
    }

    /// Runs a bash script in the folder, with the program as `$cutis`.
    fn script(&self, script: &str) -> Done {
        self.finish(&[script], Command::new("bash").args(["-c", script]).env("cutis", PROGRAM))
    }

    fn finish(&self, what: &[&str], command: &mut Command) -> Done {
        // For software Vulkan: disable a layer that needs a display, and compute on the calling
        // thread.
        let command = command.env("NODEVICE_SELECT", "1").env("LP_NUM_THREADS", "0");
        let Output { status, stdout, stderr } =
            command.current_dir(self.folder.path()).env("RUST_BACKTRACE", "1").output().unwrap();
        let done = Done {
            call: what.join(" "),
            code: status.code().unwrap_or(-1),
            stdout: String::from_utf8(stdout).unwrap(),
            stderr: String::from_utf8(stderr).unwrap(),
        };
        for sign in ["panicked", "stack backtrace", "RUST_BACKTRACE", "overflowed its stack"] {
            assert!(!done.stderr.contains(sign), "{}: {}", done.call, done.stderr);
        }
        done
    }
}

impl Done {
    /// Fails unless the exit code is 0.
    fn expect_success(self) -> Self {
        assert_eq!(self.code, 0, "{}: {}", self.call, self.stderr);
        self
    }

    /// Fails unless the call ended with `code`, printed nothing on standard output, and printed one
    /// `error:` with all the words.
    fn expect_error(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, code, "{}: {}", self.call, self.stderr);
        assert!(self.stdout.is_empty(), "{}: {}", self.call, self.stdout);
        assert_eq!(self.stderr.matches("error: ").count(), 1, "{}: {}", self.call, self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "{}: no {word:?} in: {}", self.call, self.stderr);
        }
    }
}
