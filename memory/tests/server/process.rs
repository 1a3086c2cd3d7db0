//! The process of a server that speaks MongoDB's protocol.

use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Environment variable for the program of a server outside the search path.
const PROGRAM: &str = "DESCRY_MONGOD";
/// Names of known server programs, the real one first.
const KNOWN: [&str; 2] = ["mongod", "secantusd-py"];
/// Maximum time for a server to start.
const STARTS: Duration = Duration::from_secs(60);

/// Reports a skipped test on the standard error directly, since the harness hides the output of passing
/// tests.
pub fn skipped(why: &str) {
    drop(writeln!(std::io::stderr(), "skipped: {why}"));
}

/// A server process, stopped on drop.
pub struct Process {
    child: Child,
    port: u16,
    /// Program.
    pub program: PathBuf,
    _storage: TempDir,
}

impl Process {
    /// Starts a server, or returns the reason for failing.
    pub fn start() -> Result<Process, String> {
        let program = std::env::var_os(PROGRAM).map(PathBuf::from).or_else(on_path).ok_or_else(|| {
            format!(
                "neither {} is on the search path; `pip install SecantusDB pymongo`, or name a program in {PROGRAM}",
                KNOWN.join(" nor ")
            )
        })?;
        let storage = tempfile::tempdir().map_err(|e| e.to_string())?;
        let port =
            TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).map_err(|e| e.to_string())?;
        let port = port.port();
        let mut command = Command::new(&program);
        command.args(["--port", &port.to_string()]);
        if program.file_name().is_some_and(|name| name == KNOWN[0]) {
            command.args(["--bind_ip", "127.0.0.1", "--dbpath"]).arg(storage.path());
        } else {
            command.args(["--host", "127.0.0.1", "--standalone", "--storage-path"]).arg(storage.path());
        }
        let started = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let child = started.map_err(|e| format!("{} cannot be started: {e}", program.display()))?;
        let process = Process { child, port, program, _storage: storage };
        let begin = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            if begin.elapsed() > STARTS {
                return Err(format!("{} does not answer", process.program.display()));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(process)
    }

    /// Address.
    pub fn address(&self) -> String {
        format!("mongodb://127.0.0.1:{}", self.port)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

fn on_path() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let all = KNOWN.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    all.into_iter().find(|path| path.is_file())
}
