//! Records in MongoDB. Without the feature `mongodb`, everything returns an error that names the
//! feature.

use std::path::Path;

use crate::exit::CommandError;

/// Scheme of MongoDB addresses.
const SCHEME: &str = "mongodb://";
/// Environment variable with user name and password for the server, as `NAME:PASSWORD`.
const LOGIN: &str = "DESCRY_MONGODB_LOGIN";

/// Address of a MongoDB store, and of one run or all runs in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Address of the server in the driver's form.
    server: String,
    /// Name of the run in the store; `None`: all runs.
    pub run: Option<String>,
}

impl Address {
    /// Parses `mongodb://HOST[:PORT][/DATABASE][?OPTIONS][#RUN]`.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] for anything else, and for an address with a password.
    pub fn read(text: &str) -> Result<Self, CommandError> {
        let bad = |why: &str| Err(CommandError::BadInput(format!("{}\n  {why}", without_login(text))));
        let Some(rest) = text.strip_prefix(SCHEME) else {
            return bad("expected: mongodb://HOST[:PORT]/DATABASE[#RUN]");
        };
        if rest.contains('@') {
            return bad(&format!(
                "an address is kept in run.json, a password must not be: leave NAME:PASSWORD out and set {LOGIN} to it"
            ));
        }
        let (server, run) = text.split_once('#').map_or((text, None), |(server, run)| (server, Some(run)));
        Ok(Address { server: server.into(), run: run.filter(|run| !run.is_empty()).map(str::to_owned) })
    }

    /// Address with a run's name: the one in the address, or else the name of the run's folder.
    pub fn of_run(self, folder: &Path) -> Self {
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = whole.file_name().map(|n| n.to_string_lossy().into_owned());
        Address { run: self.run.or(name), ..self }
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.server)?;
        self.run.as_ref().map_or(Ok(()), |run| write!(f, "#{run}"))
    }
}

/// True for an address of a store, false for a path.
pub fn is_address(place: &Path) -> bool {
    place.to_str().is_some_and(|text| text.starts_with("mongodb:") || text.starts_with("mongodb+srv:"))
}

fn without_login(text: &str) -> String {
    text.rsplit_once('@').map_or(text.to_owned(), |(_, host)| format!("{SCHEME}…@{host}"))
}

#[cfg(feature = "mongodb")]
mod driver {
    use std::sync::Arc;

    use descry_memory::{Error, MongoOptions, MongoStore, Options, Query, Record};

    use super::{Address, LOGIN};
    use crate::exit::CommandError;

    impl Address {
        /// Opens the record of a run for writing.
        ///
        /// # Errors
        /// [`CommandError::Broken`] if no server answers; [`CommandError::BadInput`] for a limit
        /// that the store does not support.
        pub fn write(&self, mut options: Options) -> Result<Record, CommandError> {
            options.robot = self.run.clone().unwrap_or_default();
            let store = MongoStore::open(&self.server, &self.options(&options)).map_err(refused)?;
            Ok(Record::on(Arc::new(store), options))
        }

        /// Opens the record of a run, or the whole store, for reading.
        ///
        /// # Errors
        /// [`CommandError::Broken`] if no server answers; [`CommandError::BadInput`] if there is no such run.
        pub fn read_only(&self) -> Result<Record, CommandError> {
            let options = Options { robot: self.run.clone().unwrap_or_default(), ..Options::default() };
            let store = MongoStore::open_shared(&self.server, &self.options(&options)).map_err(refused)?;
            let record = Record::on(Arc::new(store), options);
            if self.run.is_some() && is_empty(&record)? {
                let runs = self.runs()?.join(", ");
                let text = format!("{self}: there is no run of that name\n  there are: {runs}");
                return Err(CommandError::BadInput(text));
            }
            Ok(record)
        }

        /// Checks that the store answers and has no run with this name.
        ///
        /// # Errors
        /// [`CommandError::Broken`] if no server answers; [`CommandError::BadInput`] if the name is taken.
        pub fn check_free(&self, options: Options) -> Result<(), CommandError> {
            if is_empty(&self.write(options)?)? {
                return Ok(());
            }
            let text = format!(
                "{self}: it holds a run of that name already\n  name another folder with --run, or another name behind the #"
            );
            Err(CommandError::BadInput(text))
        }

        /// Names of the runs in the store.
        ///
        /// # Errors
        /// [`CommandError::Broken`] if no server answers.
        pub fn runs(&self) -> Result<Vec<String>, CommandError> {
            let store = MongoStore::open_shared(&self.server, &self.options(&Options::default()));
            store.and_then(|store| store.robots()).map_err(refused)
        }

        fn options(&self, options: &Options) -> MongoOptions {
            let login = std::env::var(LOGIN).ok();
            let login = login.as_deref().and_then(|l| l.split_once(':'));
            MongoOptions {
                robot: options.robot.clone(),
                durability: options.durability,
                retention: options.retention,
                login: login.map(|(name, password)| (name.to_owned(), password.to_owned())),
            }
        }
    }

    fn is_empty(record: &Record) -> Result<bool, CommandError> {
        let one = record.find(&Query { limit: Some(1), ..Query::default() });
        one.map(|found| found.is_empty()).map_err(CommandError::broken)
    }

    fn refused(e: Error) -> CommandError {
        match e {
            Error::Input { .. } => CommandError::bad_input(e),
            other => CommandError::broken(other),
        }
    }
}

#[cfg(not(feature = "mongodb"))]
mod driver {
    use descry_memory::{Options, Record};

    use super::Address;
    use crate::exit::CommandError;

    impl Address {
        /// Returns an error: built without MongoDB.
        pub fn write(&self, _options: Options) -> Result<Record, CommandError> {
            self.read_only()
        }

        /// Returns an error: built without MongoDB.
        pub fn check_free(&self, _options: Options) -> Result<(), CommandError> {
            self.read_only().map(|_| ())
        }

        /// Returns an error: built without MongoDB.
        pub fn runs(&self) -> Result<Vec<String>, CommandError> {
            self.read_only().map(|_| Vec::new())
        }

        /// Returns an error: built without MongoDB.
        pub fn read_only(&self) -> Result<Record, CommandError> {
            let text = format!(
                "{self}: this descry was built without MongoDB\n  build it with: cargo build --release --features mongodb"
            );
            Err(CommandError::BadInput(text))
        }
    }
}
