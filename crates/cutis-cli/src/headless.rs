//! Keeps Mesa quiet on machines without a display.

/// Begins again with `NODEVICE_SELECT=1` if there is no display session.
///
/// A layer of Mesa that orders Vulkan devices asks the display for them. Without a session it
/// prints `error: XDG_RUNTIME_DIR is invalid or not set in the environment` for each device,
/// although nothing is wrong. The variable switches the layer off. A program can change its own
/// environment safely only by beginning again; that takes a millisecond and keeps the process id.
#[cfg(all(target_os = "linux", feature = "gpu"))]
pub(crate) fn quiet_drivers() {
    use std::os::unix::process::CommandExt;

    const LAYER_OFF: &str = "NODEVICE_SELECT";
    if std::env::var_os("XDG_RUNTIME_DIR").is_some() || std::env::var_os(LAYER_OFF).is_some() {
        return;
    }
    let mut args = std::env::args_os();
    if let (Ok(program), Some(name)) = (std::env::current_exe(), args.next()) {
        // If it cannot begin again, it goes on with a few more lines on standard error.
        let _ = std::process::Command::new(program).arg0(name).args(args).env(LAYER_OFF, "1").exec();
    }
}

/// Does nothing: only Linux has the layer, and only a build with `gpu` opens devices.
#[cfg(not(all(target_os = "linux", feature = "gpu")))]
pub(crate) fn quiet_drivers() {}
