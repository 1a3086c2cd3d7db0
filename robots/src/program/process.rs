//! Child process that runs a robot program: restricted at the start, and killed at the end with all its own
//! children.

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use std::collections::VecDeque;
use std::io::Read;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Names of the environment variables passed to a program, which leaves out keys, tokens and logins.
const ENVIRONMENT: [&str; 12] = [
    "PATH",
    "HOME",
    "USER",
    "LANG",
    "LC_ALL",
    "LC_CTYPE",
    "TZ",
    "TMPDIR",
    "DISPLAY",
    "PYTHONPATH",
    "VIRTUAL_ENV",
    "LD_LIBRARY_PATH",
];
/// Maximum number of last bytes of standard error that are kept.
const LAST_WORDS: usize = 4096;
/// Maximum number of last lines of standard error that are shown.
const SHOWN_LINES: usize = 6;
/// Time in which a program may exit by itself once its input is closed.
const PARTING: Duration = Duration::from_millis(500);
/// Interval between checks whether the program has ended.
const GLANCE: Duration = Duration::from_millis(5);

/// A program in a process group of its own.
pub(super) struct Process {
    child: Child,
    last_words: Arc<Mutex<VecDeque<u8>>>,
}

impl Process {
    /// Starts a shell command line, with `memory_bytes` of address space for each of its processes.
    ///
    /// # Errors
    /// Reason for which the program could not be started.
    pub fn start(command_line: &str, memory_bytes: u64) -> Result<(Self, ChildStdin, ChildStdout), String> {
        // A soft limit: a program that needs more may say so in its own command line.
        let script = format!("ulimit -S -v {} 2>/dev/null\n{command_line}", memory_bytes / 1024);
        let mut command = Command::new("/bin/sh");
        command.arg("-c").arg(script).process_group(0).env_clear();
        command.envs(ENVIRONMENT.iter().filter_map(|name| Some((name, std::env::var_os(name)?))));
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|e| format!("it could not be started: {e}"))?;
        let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let last_words = Arc::default();
        let process = Process { child, last_words: Arc::clone(&last_words) };
        let (Some(stdin), Some(stdout), Some(stderr)) = (stdin, stdout, stderr) else {
            return Err("it was started without pipes".into());
        };
        thread::spawn(move || listen(stderr, &last_words));
        Ok((process, stdin, stdout))
    }

    /// True if the program has ended; its child processes may live on.
    pub fn has_ended(&self) -> bool {
        self.ends_within(Duration::ZERO)
    }

    /// Waits up to `limit` for the end of the program; true if it has ended. The process is not reaped, so
    /// that its process group keeps its number.
    fn ends_within(&self, limit: Duration) -> bool {
        let Some(pid) = pid(&self.child) else { return true };
        let deadline = Instant::now() + limit;
        loop {
            let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
            match waitid(WaitId::Pid(pid), options) {
                Ok(None) if Instant::now() < deadline => thread::sleep(GLANCE),
                Ok(None) => return false,
                Ok(Some(_)) | Err(_) => return true,
            }
        }
    }

    /// Kills all processes of the program; returns the exit status and the last lines of standard error.
    /// Called after the program closed its output or violated the protocol.
    pub fn epitaph(&mut self) -> String {
        let by_itself = self.ends_within(GLANCE * 20);
        let status = self.kill();
        // Standard error is read by a thread, which ends with the last process that holds it.
        let deadline = Instant::now() + GLANCE * 20;
        while Arc::strong_count(&self.last_words) > 1 && Instant::now() < deadline {
            thread::sleep(GLANCE);
        }
        let words = self.last_words.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes: Vec<u8> = words.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).collect();
        let shown: Vec<String> = lines
            .iter()
            .skip(lines.len().saturating_sub(SHOWN_LINES))
            .map(|l| format!("\n    {l}"))
            .collect();
        let how = if by_itself { format!(" ({status})") } else { " (it was killed)".into() };
        format!("{how}{}", shown.concat())
    }

    fn kill(&mut self) -> String {
        if let Some(pid) = pid(&self.child) {
            let _ = kill_process_group(pid, Signal::KILL);
        }
        self.child.wait().map_or_else(|e| e.to_string(), |status| status.to_string())
    }
}

impl Drop for Process {
    /// Kills the process group, after a short time in which the program can stop the body; its input is
    /// closed by now.
    fn drop(&mut self) {
        self.ends_within(PARTING);
        self.kill();
    }
}

fn pid(child: &Child) -> Option<Pid> {
    Pid::from_raw(i32::try_from(child.id()).ok()?)
}

/// Reads a program's standard error and keeps its end.
fn listen(mut stderr: ChildStderr, last_words: &Mutex<VecDeque<u8>>) {
    let mut chunk = [0; 1024];
    while let Ok(n @ 1..) = stderr.read(&mut chunk) {
        let mut words = last_words.lock().unwrap_or_else(PoisonError::into_inner);
        words.extend(&chunk[..n]);
        let over = words.len().saturating_sub(LAST_WORDS);
        words.drain(..over);
    }
}
