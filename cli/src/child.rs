//! Runs a descry command in a child process, with its progress and a stop as by Ctrl-C.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use descry_agent::exit::Exit;
use rustix::process::{Pid, Signal, kill_process};

/// Time for a stopped command to halt the body and finish its record.
pub(crate) const HALT: Duration = Duration::from_secs(20);
/// Interval between checks for the end of a stopped command.
pub(crate) const POLL: Duration = Duration::from_millis(20);

/// Running command, possibly in several processes one after the other.
#[derive(Default)]
pub(crate) struct Child(Mutex<State>);

#[derive(Default)]
struct State {
    process: Option<Pid>,
    is_stopped: bool,
    has_ended: bool,
}

/// Result of a command.
pub(crate) struct Ended {
    /// The exit code.
    pub(crate) exit: i32,
    /// Standard output.
    pub(crate) out: String,
    /// Narration on standard error.
    pub(crate) told: String,
}

impl Child {
    /// True if the work has ended, so that nothing more will run.
    pub(crate) fn has_ended(&self) -> bool {
        self.state(|state| state.has_ended)
    }

    /// Marks the end of all work; true if the work was stopped.
    pub(crate) fn end(&self) -> bool {
        self.state(|state| {
            state.has_ended = true;
            state.process = None;
            state.is_stopped
        })
    }

    /// Stops the command by SIGINT, as Ctrl-C does.
    pub(crate) fn stop(&self) {
        self.state(|state| {
            state.is_stopped = true;
            // It may end at this very moment.
            state.process.map(|process| kill_process(process, Signal::INT).ok())
        });
    }

    fn state<T>(&self, of: impl FnOnce(&mut State) -> T) -> T {
        of(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Runs a descry command line; `begun` receives the process ID, `tell` each line of narration.
    ///
    /// # Errors
    /// The process cannot be started or waited for.
    pub(crate) fn carry_out(
        &self,
        words: &[String],
        input: &str,
        at: &Path,
        begun: impl FnOnce(u32),
        tell: &mut dyn FnMut(&str),
    ) -> Result<Ended, String> {
        let own = std::env::current_exe().map_err(|e| format!("the program of descry is gone: {e}"))?;
        let mut command = Command::new(own);
        command.args(words).current_dir(at);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|e| format!("descry does not start: {e}"))?;
        let process = Pid::from_child(&child);
        begun(child.id());
        let is_stopped = self.state(|state| {
            state.process = Some(process);
            state.is_stopped
        });
        if is_stopped {
            self.stop();
        }
        let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let mut told = String::new();
        let out = std::thread::scope(|scope| {
            scope.spawn(|| {
                // One that reads nothing has ended.
                stdin.map(|mut stdin| stdin.write_all(input.as_bytes()).ok())
            });
            let out = scope.spawn(|| {
                let mut out = Vec::new();
                stdout.map(|mut stdout| stdout.read_to_end(&mut out));
                String::from_utf8_lossy(&out).into_owned()
            });
            for line in stderr.into_iter().flat_map(|stderr| BufReader::new(stderr).split(b'\n')) {
                let Ok(line) = line else { break };
                let line = String::from_utf8_lossy(&line);
                told += &format!("{line}\n");
                if !line.trim().is_empty() {
                    tell(line.trim_end());
                }
            }
            out.join().unwrap_or_default()
        });
        let exit = self.wait(&mut child)?;
        Ok(Ended { exit, out, told })
    }

    /// Waits for the exit code of a command whose output has ended; kills a stopped one that does not exit.
    fn wait(&self, child: &mut std::process::Child) -> Result<i32, String> {
        let mut stopped: Option<Instant> = None;
        loop {
            if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
                return Ok(status.code().unwrap_or(Exit::Bug as i32));
            }
            if self.state(|state| state.is_stopped)
                && stopped.get_or_insert_with(Instant::now).elapsed() > HALT
            {
                child.kill().map_err(|e| e.to_string())?;
            }
            std::thread::sleep(POLL);
        }
    }
}
