//! Bags in SQLite (`.db3`).

use super::{Message, Messages, Place, Topic};
use crate::input::InputError;
use crate::recorded::folder::shown;
use rusqlite::{Connection, OpenFlags};
use std::path::{Path, PathBuf};

pub(super) struct Sqlite {
    path: PathBuf,
    connection: Connection,
    topics: Vec<(i64, Topic)>,
}

fn failed(path: &Path, e: &rusqlite::Error) -> InputError {
    InputError::whole(
        shown(path),
        format!("cannot be read as a bag: {e}"),
        "was it copied while it was being written?",
    )
}

impl Sqlite {
    pub(super) fn open(path: &Path) -> Result<Sqlite, InputError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let read = || -> rusqlite::Result<(Connection, Vec<(i64, Topic)>)> {
            let connection = Connection::open_with_flags(path, flags)?;
            let mut query = connection.prepare("SELECT id, name, type, serialization_format FROM topics")?;
            let topic = |row: &rusqlite::Row| {
                Ok((row.get(0)?, Topic { name: row.get(1)?, kind: row.get(2)?, encoding: row.get(3)? }))
            };
            let topics = query.query_map([], topic)?.collect::<rusqlite::Result<_>>()?;
            drop(query);
            Ok((connection, topics))
        };
        let (connection, topics) = read().map_err(|e| failed(path, &e))?;
        Ok(Sqlite { path: path.into(), connection, topics })
    }
}

impl Messages for Sqlite {
    fn topics(&self) -> Vec<Topic> {
        self.topics.iter().map(|(_, topic)| topic.clone()).collect()
    }

    fn each(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        see: &mut dyn FnMut(Message<'_>) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let failed = |e: &rusqlite::Error| failed(&self.path, e);
        let text = "SELECT id, topic_id, data FROM messages ORDER BY timestamp, id";
        let mut query = self.connection.prepare(text).map_err(|e| failed(&e))?;
        let mut rows = query.query([]).map_err(|e| failed(&e))?;
        while let Some(row) = rows.next().map_err(|e| failed(&e))? {
            let topic: i64 = row.get(1).map_err(|e| failed(&e))?;
            let Some((_, topic)) = self.topics.iter().find(|(id, t)| *id == topic && wanted(t)) else {
                continue;
            };
            let id: i64 = row.get(0).map_err(|e| failed(&e))?;
            let data = row.get_ref(2).map_err(|e| failed(&e))?;
            let data = data.as_blob().map_err(|_| failed(&rusqlite::Error::InvalidQuery))?;
            see(Message { topic, place: Place(id as u64, 0), data })?;
        }
        Ok(())
    }

    fn at(&mut self, place: Place) -> Result<Vec<u8>, InputError> {
        let read =
            self.connection
                .query_row("SELECT data FROM messages WHERE id = ?1", [place.0 as i64], |r| r.get(0));
        read.map_err(|e| failed(&self.path, &e))
    }
}
