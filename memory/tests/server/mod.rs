//! Server with MongoDB's protocol, shared by concurrent tests.

pub mod process;

use process::{Process, skipped};
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Environment variable for the address of a running server, such as `mongodb://127.0.0.1:27017`.
const ADDRESS: &str = "DESCRY_MONGODB_URL";

/// A server, and the databases made by tests.
pub struct Server {
    address: String,
    /// Prefix of the databases of this test run.
    prefix: String,
    used: Mutex<Vec<String>>,
    process: Option<Process>,
}

impl Server {
    /// The shared server, started if none runs; none, with a message, if none can be started.
    pub fn shared() -> Option<Arc<Server>> {
        static RUNNING: Mutex<Weak<Server>> = Mutex::new(Weak::new());
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(server) = running.upgrade() {
            return Some(server);
        }
        let found = Self::find();
        let server = found.map_err(|why| skipped(&why)).ok().map(Arc::new)?;
        *running = Arc::downgrade(&server);
        Some(server)
    }

    fn find() -> Result<Server, String> {
        let of = |address, process| Server {
            address,
            prefix: format!("descry_test_{}", std::process::id()),
            used: Mutex::default(),
            process,
        };
        if let Ok(address) = std::env::var(ADDRESS) {
            return Ok(of(address.trim_end_matches('/').to_owned(), None));
        }
        let process = Process::start()
            .map_err(|why| format!("{why}, or the address of a server that runs in {ADDRESS}"))?;
        Ok(of(process.address(), Some(process)))
    }

    /// The address of a database in it.
    pub fn address(&self, database: &str) -> String {
        let name = format!("{}_{database}", self.prefix);
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        if !used.contains(&name) {
            used.push(name.clone());
        }
        format!("{}/{name}", self.address)
    }

    /// A database in it.
    pub fn database(&self, database: &str) -> mongodb::sync::Database {
        let client = mongodb::sync::Client::with_uri_str(self.address(database)).unwrap();
        client.default_database().unwrap()
    }

    /// Output of a Python program with pymongo; none without pymongo.
    pub fn python(&self, program: &str, arguments: &[&str]) -> Option<String> {
        let beside = self.process.as_ref().map(|p| p.program.with_file_name("python3"));
        let python = beside.filter(|p| p.exists()).unwrap_or_else(|| "python3".into());
        if !Command::new(&python).args(["-c", "import pymongo, gridfs"]).status().is_ok_and(|s| s.success()) {
            skipped(&format!("{} has no pymongo; `pip install pymongo`", python.display()));
            return None;
        }
        let output = Command::new(python).args(["-c", program]).args(arguments).output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{err}");
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if self.process.is_some() {
            return;
        }
        // A server of the user's is left as it was.
        let used = std::mem::take(self.used.get_mut().unwrap_or_else(PoisonError::into_inner));
        if let Ok(client) = mongodb::sync::Client::with_uri_str(&self.address) {
            used.iter().for_each(|name| drop(client.database(name).drop().run()));
        }
    }
}
