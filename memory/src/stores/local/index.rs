//! Index of the records, by location and by query criteria. It follows entirely from the segments, so that it
//! need not be synced with every record and can be rebuilt.

use super::pins;
use super::segment::{Located, Spot};
use crate::document::{Document, Near, Order, Query, RecordId};
use crate::error::Error;
use crate::stores::{Count, Stats};
use rusqlite::types::Value as Sql;
use rusqlite::{
    Connection, OpenFlags, OptionalExtension, Params, Row, Transaction, params, params_from_iter,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Name of the index file.
pub(super) const INDEX: &str = "index.sqlite";
/// Version of the index format; an older index is rebuilt, a newer one is refused.
const FORMAT: i64 = 2;

const TABLES: &str = "
CREATE TABLE meta(key TEXT PRIMARY KEY, value INTEGER) WITHOUT ROWID;
CREATE TABLE segments(number INTEGER PRIMARY KEY, bytes INTEGER NOT NULL, sealed INTEGER NOT NULL, going INTEGER NOT NULL DEFAULT 0);
CREATE TABLE names(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE kinds(kind INTEGER, frame INTEGER, records INTEGER NOT NULL, bytes INTEGER NOT NULL, PRIMARY KEY(kind, frame)) WITHOUT ROWID;
CREATE TABLE records(id INTEGER PRIMARY KEY, kind INTEGER NOT NULL, frame INTEGER NOT NULL, robot INTEGER NOT NULL,
  stamp INTEGER NOT NULL, ends INTEGER, segment INTEGER NOT NULL, chunk INTEGER NOT NULL, document INTEGER NOT NULL,
  document_bytes INTEGER NOT NULL, document_crc INTEGER NOT NULL, blobs BLOB NOT NULL, bytes INTEGER NOT NULL);
CREATE INDEX records_stamp ON records(stamp, id);
CREATE INDEX records_frame ON records(kind, frame, stamp, id);
CREATE INDEX records_kind ON records(kind, stamp, id);
CREATE INDEX records_segment ON records(segment, stamp);
CREATE TABLE objects(name INTEGER, confidence REAL, record INTEGER, PRIMARY KEY(name, confidence, record)) WITHOUT ROWID;
CREATE INDEX objects_record ON objects(record);
CREATE VIRTUAL TABLE seen_from USING rtree(record, x0, x1, y0, y1, z0, z1, +x REAL, +y REAL, +z REAL);
CREATE VIRTUAL TABLE covers USING rtree(record, x0, x1, y0, y1, z0, z1, +ax REAL, +bx REAL, +ay REAL, +by REAL, +az REAL, +bz REAL);
CREATE TABLE pins(record INTEGER, holder TEXT, PRIMARY KEY(record, holder)) WITHOUT ROWID;
CREATE INDEX pins_holder ON pins(holder);
";

/// Location of a record.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub id: RecordId,
    pub stamp_ns: i64,
    pub segment: u64,
    pub located: Located,
}

/// A segment in the index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SegmentRow {
    pub number: u64,
    pub bytes: u64,
    pub sealed: bool,
    /// True if the segment is marked for deletion.
    pub going: bool,
}

pub(super) struct Index {
    db: Connection,
    pub dir: PathBuf,
    names: BTreeMap<String, i64>,
}

impl Index {
    /// Opens or creates the index of a folder for writing.
    ///
    /// `log_bytes` limits the write-ahead log.
    pub fn open(dir: &Path, log_bytes: u64) -> Result<Self, Error> {
        let index = Self::connect(dir, OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE)?;
        let run = |sql: &str| index.db.execute_batch(sql).map_err(|e| index.err(e));
        let format: i64 =
            index.db.query_row("PRAGMA user_version", [], |r| r.get(0)).map_err(|e| index.err(e))?;
        if format == 0 {
            run("PRAGMA auto_vacuum=INCREMENTAL")?;
        }
        run("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL; PRAGMA cache_size=-8192")?;
        let pages = (log_bytes / 4096).clamp(16, 1000);
        run(&format!("PRAGMA wal_autocheckpoint={pages}; PRAGMA journal_size_limit={}", pages * 4096))?;
        if format == 0 {
            run(&format!("BEGIN; {TABLES} PRAGMA user_version={FORMAT}; COMMIT"))?;
        }
        Ok(index)
    }

    /// Opens the index of a folder for reading, while another process may be writing it.
    pub fn open_shared(dir: &Path) -> Result<Self, Error> {
        Self::connect(dir, OpenFlags::SQLITE_OPEN_READ_ONLY)
    }

    /// Creates an index in memory.
    pub fn in_memory(dir: &Path) -> Result<Self, Error> {
        let db = Connection::open_in_memory().map_err(|e| Error::index(dir, e))?;
        db.execute_batch(TABLES).map_err(|e| Error::index(dir, e))?;
        Ok(Index { db, dir: dir.to_owned(), names: BTreeMap::new() })
    }

    /// Closes the file; later queries find nothing.
    pub fn close(&mut self) -> Result<(), Error> {
        let none = Connection::open_in_memory().map_err(|e| self.err(e))?;
        std::mem::replace(&mut self.db, none).close().map_err(|(_, e)| self.err(e))
    }

    fn connect(dir: &Path, flags: OpenFlags) -> Result<Self, Error> {
        let flags = flags | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let db = Connection::open_with_flags(dir.join(INDEX), flags).map_err(|e| Error::index(dir, e))?;
        db.busy_timeout(Duration::from_secs(5)).map_err(|e| Error::index(dir, e))?;
        db.set_prepared_statement_cache_capacity(64);
        Ok(Index { db, dir: dir.to_owned(), names: BTreeMap::new() })
    }

    /// True if the index has the current format; an index of an older format has to be rebuilt.
    ///
    /// # Errors
    /// [`Error::Damaged`] for an index of a newer format, which must not be overwritten.
    pub fn is_current(&self) -> Result<bool, Error> {
        let format: i64 =
            self.db.query_row("PRAGMA user_version", [], |r| r.get(0)).map_err(|e| self.err(e))?;
        if format > FORMAT {
            let what = format!(
                "index format {format} is newer than {FORMAT}, which this version reads: update descry"
            );
            return Err(Error::Damaged { place: self.dir.join(INDEX), at: 0, what });
        }
        Ok(format == FORMAT)
    }

    fn rows<T>(
        &self,
        sql: &str,
        with: impl Params,
        read: impl FnMut(&Row) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, Error> {
        let rows = || self.db.prepare_cached(sql)?.query_map(with, read)?.collect();
        let rows: rusqlite::Result<Vec<T>> = rows();
        rows.map_err(|e| self.err(e))
    }

    fn err(&self, e: rusqlite::Error) -> Error {
        Error::index(&self.dir, e)
    }

    /// Inserts the records of a chunk together with the indexed length of its segment.
    pub fn insert(&mut self, segment: u64, end: u64, records: &[(&Document, &Located)]) -> Result<(), Error> {
        let mut fresh = BTreeMap::new();
        let dir = self.dir.clone();
        let result = (|| -> rusqlite::Result<()> {
            let tx = self.db.transaction()?;
            tx.prepare_cached("INSERT INTO segments(number, bytes, sealed) VALUES(?1, ?2, 0) ON CONFLICT DO UPDATE SET bytes = ?2")?
                .execute(params![segment as i64, end as i64])?;
            for (document, located) in records {
                insert_one(&tx, &self.names, &mut fresh, segment, document, located)?;
                pins::apply(&tx, document)?;
            }
            tx.commit()
        })();
        result.map_err(|e| Error::index(&dir, e))?;
        self.names.append(&mut fresh);
        Ok(())
    }

    /// Marks a segment as complete.
    pub fn seal(&mut self, segment: u64, bytes: u64) -> Result<(), Error> {
        let sql = "INSERT INTO segments(number, bytes, sealed) VALUES(?1, ?2, 1) ON CONFLICT DO UPDATE SET bytes = ?2, sealed = 1";
        self.db.execute(sql, params![segment as i64, bytes as i64]).map(|_| ()).map_err(|e| self.err(e))
    }

    /// Every segment, oldest first.
    pub fn segments(&self) -> Result<Vec<SegmentRow>, Error> {
        self.rows("SELECT number, bytes, sealed, going FROM segments ORDER BY number", [], |r| {
            Ok(SegmentRow {
                number: unsigned(r, 0)?,
                bytes: unsigned(r, 1)?,
                sealed: r.get(2)?,
                going: r.get(3)?,
            })
        })
    }

    /// Oldest complete segment that has an unpinned record, or no record, in order of the newest record of
    /// each: its number, and the stamp of its newest record in nanoseconds, -1 without records.
    pub fn oldest_segment(&self) -> Result<Option<(u64, i64)>, Error> {
        let sql = "SELECT s.number, coalesce((SELECT max(stamp) FROM records WHERE segment = s.number), -1) AS newest FROM segments s
            WHERE s.sealed AND NOT s.going AND (
              NOT EXISTS (SELECT 1 FROM records WHERE segment = s.number) OR
              EXISTS (SELECT 1 FROM records r WHERE r.segment = s.number AND NOT EXISTS (SELECT 1 FROM pins WHERE record = r.id)))
            ORDER BY newest, s.number LIMIT 1";
        let mut statement = self.db.prepare_cached(sql).map_err(|e| self.err(e))?;
        statement.query_row([], |r| Ok((unsigned(r, 0)?, r.get(1)?))).optional().map_err(|e| self.err(e))
    }

    /// Latest end of the records of a segment, nanoseconds; `None` without records.
    pub fn lasts_until(&self, segment: u64) -> Result<Option<i64>, Error> {
        let sql = "SELECT max(coalesce(ends, stamp)) FROM records WHERE segment = ?1";
        self.db.query_row(sql, [segment as i64], |r| r.get(0)).map_err(|e| self.err(e))
    }

    /// Marks a segment, durably, as about to be deleted.
    pub fn mark_going(&mut self, segment: u64) -> Result<(), Error> {
        self.durably(|db| {
            db.execute("UPDATE segments SET going = 1 WHERE number = ?1", [segment as i64]).map(|_| ())
        })
    }

    fn durably(&mut self, write: impl FnOnce(&mut Connection) -> rusqlite::Result<()>) -> Result<(), Error> {
        self.db.execute_batch("PRAGMA synchronous=FULL").map_err(|e| self.err(e))?;
        let result = write(&mut self.db);
        let back = self.db.execute_batch("PRAGMA synchronous=NORMAL");
        result.and(back).map_err(|e| self.err(e))
    }

    /// Removes a segment and its records; returns the number of records.
    pub fn forget(&mut self, segment: u64) -> Result<u64, Error> {
        const GOING: &str = "SELECT id FROM records WHERE segment = ?1";
        self.keep_numbers(self.next_id()?)?;
        let dir = self.dir.clone();
        let which = [segment as i64];
        let result = (|| -> rusqlite::Result<u64> {
            let tx = self.db.transaction()?;
            tx.execute(
                "UPDATE kinds SET records = records - g.n, bytes = bytes - g.b FROM
                   (SELECT kind AS k, frame AS f, count(*) AS n, sum(bytes) AS b FROM records
                    WHERE segment = ?1 GROUP BY kind, frame) AS g
                 WHERE kind = g.k AND frame = g.f",
                which,
            )?;
            tx.execute("DELETE FROM kinds WHERE records = 0", [])?;
            for table in ["objects", "seen_from", "covers", "pins"] {
                tx.execute(&format!("DELETE FROM {table} WHERE record IN ({GOING})"), which)?;
            }
            let gone = tx.execute("DELETE FROM records WHERE segment = ?1", which)?;
            tx.execute("DELETE FROM segments WHERE number = ?1", which)?;
            tx.commit()?;
            let mut vacuum = self.db.prepare("PRAGMA incremental_vacuum")?;
            let mut steps = vacuum.query([])?;
            while steps.next()?.is_some() {}
            Ok(gone as u64)
        })();
        result.map_err(|e| Error::index(&dir, e))
    }

    /// Reserves all record numbers below `next`: none is reused, even when every record is gone.
    pub fn keep_numbers(&self, next: RecordId) -> Result<(), Error> {
        let sql = "INSERT INTO meta VALUES('next', ?1) ON CONFLICT DO UPDATE SET value = max(value, ?1)";
        self.db.execute(sql, [next.0 as i64]).map(|_| ()).map_err(|e| self.err(e))
    }

    /// Rebuilds the pins from documents that change pins: `said` are all of them, in order of number.
    pub fn pin_again(&mut self, said: &[Document]) -> Result<(), Error> {
        let dir = self.dir.clone();
        let result = (|| -> rusqlite::Result<()> {
            let tx = self.db.transaction()?;
            tx.execute("DELETE FROM pins", [])?;
            said.iter().try_for_each(|document| pins::apply(&tx, document))?;
            tx.commit()
        })();
        result.map_err(|e| Error::index(&dir, e))
    }

    /// Number and segment of every record, ordered by number.
    pub fn numbers(&self) -> Result<Vec<(RecordId, u64)>, Error> {
        let read = |r: &Row| Ok((RecordId(unsigned(r, 0)?), unsigned(r, 1)?));
        self.rows("SELECT id, segment FROM records ORDER BY id", [], read)
    }

    /// Number of the next record.
    pub fn next_id(&self) -> Result<RecordId, Error> {
        let sql = "SELECT max(coalesce((SELECT max(id) + 1 FROM records), 1), coalesce((SELECT value FROM meta WHERE key = 'next'), 1))";
        self.db.query_row(sql, [], |r| unsigned(r, 0)).map(RecordId).map_err(|e| self.err(e))
    }

    /// Location of a record; `None` if there is no such record.
    pub fn place(&self, id: RecordId) -> Result<Option<Place>, Error> {
        let sql = format!("SELECT {PLACE} FROM records WHERE id = ?1");
        let mut statement = self.db.prepare_cached(&sql).map_err(|e| self.err(e))?;
        statement.query_row([id.0 as i64], place).optional().map_err(|e| self.err(e))
    }

    /// Locations of all records of a segment, or only of its pinned ones.
    pub fn places(&self, segment: u64, pinned_only: bool) -> Result<Vec<Place>, Error> {
        let pinned = if pinned_only { "AND id IN (SELECT record FROM pins)" } else { "" };
        let sql = format!("SELECT {PLACE} FROM records WHERE segment = ?1 {pinned} ORDER BY id");
        self.rows(&sql, [segment as i64], place)
    }

    /// Locations of the records that match a query.
    pub fn find(&self, query: &Query) -> Result<Vec<Place>, Error> {
        let (mut sql, mut values) = self.select(query);
        if let Some((stamp, id)) = query.after {
            let sign = if query.order == Order::Oldest { ">" } else { "<" };
            sql.push_str(&format!(" AND (stamp, id) {sign} (?, ?)"));
            values.extend([Sql::Integer(stamp), Sql::Integer(id.0 as i64)]);
        }
        sql.push_str(match query.order {
            Order::Oldest => " ORDER BY stamp, id",
            Order::Newest => " ORDER BY stamp DESC, id DESC",
        });
        if let Some(limit) = query.limit {
            sql.push_str(" LIMIT ?");
            values.push(Sql::Integer(limit as i64));
        }
        self.rows(&sql, params_from_iter(values), place)
    }

    /// Location of the record nearest in time among those that match a query; `None` if none matches.
    pub fn nearest(&self, query: &Query, stamp_ns: i64) -> Result<Option<Place>, Error> {
        let (select, values) = self.select(query);
        let one = |end: &str| -> Result<Option<Place>, Error> {
            let sql = select.clone() + end;
            let mut values = values.clone();
            values.push(Sql::Integer(stamp_ns));
            let mut statement = self.db.prepare_cached(&sql).map_err(|e| self.err(e))?;
            statement.query_row(params_from_iter(values), place).optional().map_err(|e| self.err(e))
        };
        let before = one(" AND stamp <= ? ORDER BY stamp DESC, id DESC LIMIT 1")?;
        if before.as_ref().is_some_and(|place| place.stamp_ns == stamp_ns) {
            return Ok(before);
        }
        let after = one(" AND stamp > ? ORDER BY stamp, id DESC LIMIT 1")?;
        let off = |place: &Place| place.stamp_ns.abs_diff(stamp_ns);
        Ok(match (before, after) {
            (Some(b), Some(a)) => Some(if off(&a) < off(&b) { a } else { b }),
            (b, a) => b.or(a),
        })
    }

    /// SQL for the conditions of a query, without its order and limit.
    fn select(&self, query: &Query) -> (String, Vec<Sql>) {
        let mut sql = format!("SELECT {PLACE} FROM records WHERE 1");
        let mut values = Vec::new();
        let mut also = |condition: &str, with: &[Sql]| {
            sql.push_str(" AND ");
            sql.push_str(condition);
            values.extend_from_slice(with);
        };
        for (column, name) in [("kind", &query.kind), ("frame", &query.frame), ("robot", &query.robot)] {
            if let Some(name) = name {
                also(
                    &format!("{column} = (SELECT id FROM names WHERE name = ?)"),
                    &[Sql::Text(name.clone())],
                );
            }
        }
        if let Some(from) = query.from_ns {
            also("(stamp >= ? OR ends >= ?)", &[Sql::Integer(from), Sql::Integer(from)]);
        }
        if let Some(to) = query.to_ns {
            also("stamp <= ?", &[Sql::Integer(to)]);
        }
        if let Some(near) = query.seen_from {
            also(
                &format!("id IN (SELECT record FROM seen_from WHERE {WITHIN} AND {FROM_DISTANCE} <= ?)"),
                &ball(near, 2),
            );
        }
        if let Some(near) = query.covers {
            also(
                &format!("id IN (SELECT record FROM covers WHERE {WITHIN} AND {COVER_DISTANCE} <= ?)"),
                &ball(near, 4),
            );
        }
        match (&query.object, query.min_confidence) {
            (Some(object), least) => also(
                "id IN (SELECT record FROM objects WHERE name = (SELECT id FROM names WHERE name = ?) AND confidence >= ?)",
                &[Sql::Text(object.clone()), Sql::Real(least.unwrap_or(0.0))],
            ),
            (None, Some(least)) => {
                also("id IN (SELECT record FROM objects WHERE confidence >= ?)", &[Sql::Real(least)])
            }
            (None, None) => (),
        }
        (sql, values)
    }

    /// The frames of the records of a kind, sorted.
    pub fn frames(&self, kind: &str) -> Result<Vec<String>, Error> {
        let sql = "SELECT f.name FROM kinds JOIN names f ON f.id = frame WHERE kind = (SELECT id FROM names WHERE name = ?1) ORDER BY f.name";
        self.rows(sql, [kind], |r| r.get(0))
    }

    /// Updates the locations of moved records.
    pub fn relocate(
        &mut self,
        segment: u64,
        end: u64,
        records: &[(RecordId, &Located)],
    ) -> Result<(), Error> {
        let dir = self.dir.clone();
        let result = (|| -> rusqlite::Result<()> {
            let tx = self.db.transaction()?;
            tx.execute(
                "INSERT INTO segments(number, bytes, sealed) VALUES(?1, ?2, 0) ON CONFLICT DO UPDATE SET bytes = ?2",
                params![segment as i64, end as i64],
            )?;
            for (id, l) in records {
                tx.prepare_cached(MOVE)?.execute(params![
                    id.0 as i64,
                    segment as i64,
                    l.chunk as i64,
                    l.document.at as i64,
                    spots(&l.blobs)
                ])?;
            }
            tx.commit()
        })();
        result.map_err(|e| Error::index(&dir, e))
    }

    /// Numbers of the pinned records, with the names of the holders of the pins.
    pub fn pins(&self) -> Result<BTreeMap<RecordId, BTreeSet<String>>, Error> {
        let mut pins: BTreeMap<RecordId, BTreeSet<String>> = BTreeMap::new();
        let mut read = || -> rusqlite::Result<()> {
            let mut statement = self.db.prepare_cached("SELECT record, holder FROM pins")?;
            let mut rows = statement.query([])?;
            while let Some(row) = rows.next()? {
                pins.entry(RecordId(unsigned(row, 0)?)).or_default().insert(row.get(1)?);
            }
            Ok(())
        };
        read().map_err(|e| self.err(e))?;
        Ok(pins)
    }

    /// Names of the holders of pins, with the number and the bytes of the records that each holds, largest
    /// first.
    pub fn holders(&self) -> Result<Vec<(String, u64, u64)>, Error> {
        let sql = "SELECT holder, count(*), sum(bytes) FROM pins JOIN records ON id = record GROUP BY holder ORDER BY 3 DESC, 1";
        self.rows(sql, [], |r| Ok((r.get(0)?, unsigned(r, 1)?, unsigned(r, 2)?)))
    }

    /// Total bytes of pinned records.
    pub fn pinned_bytes(&self) -> Result<u64, Error> {
        let sql = "SELECT coalesce(sum(bytes), 0) FROM records WHERE id IN (SELECT record FROM pins)";
        self.db.query_row(sql, [], |r| unsigned(r, 0)).map_err(|e| self.err(e))
    }

    /// Counts of the store; the caller adds sizes on the disk.
    pub fn stats(&self) -> Result<Stats, Error> {
        let mut stats = Stats::default();
        let mut read = || -> rusqlite::Result<()> {
            let mut statement =
                self.db.prepare_cached("SELECT k.name, sum(records), sum(bytes) FROM kinds JOIN names k ON k.id = kind GROUP BY kind")?;
            let mut rows = statement.query([])?;
            while let Some(row) = rows.next()? {
                let count = Count { records: unsigned(row, 1)?, bytes: unsigned(row, 2)? };
                stats.records += count.records;
                stats.kinds.insert(row.get(0)?, count);
            }
            (stats.oldest_ns, stats.newest_ns) = self.db.query_row(
                "SELECT (SELECT min(stamp) FROM records), (SELECT max(stamp) FROM records)",
                [],
                |r| Ok((r.get(0)?, r.get(1)?)),
            )?;
            stats.pinned =
                self.db.query_row("SELECT count(DISTINCT record) FROM pins", [], |r| unsigned(r, 0))?;
            stats.segments = self.db.query_row("SELECT count(*) FROM segments", [], |r| unsigned(r, 0))?;
            Ok(())
        };
        read().map_err(|e| self.err(e))?;
        Ok(stats)
    }

    /// Merges the write-ahead log into the index and truncates it.
    pub fn empty_log(&mut self) -> Result<(), Error> {
        let run = |r: &Row| r.get::<_, i64>(0);
        self.db.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], run).map(|_| ()).map_err(|e| self.err(e))
    }

    /// Faults that SQLite's integrity check reports.
    pub fn check(&self) -> Result<Vec<String>, Error> {
        let found: Vec<String> = self.rows("PRAGMA integrity_check", [], |r| r.get(0))?;
        Ok(found.into_iter().filter(|line| line != "ok").collect())
    }
}

const PLACE: &str = "id, segment, chunk, document, document_bytes, blobs, bytes, document_crc, stamp";
/// Updates the location of a record, whose bytes stay the same.
const MOVE: &str = "UPDATE records SET segment = ?2, chunk = ?3, document = ?4, blobs = ?5 WHERE id = ?1";
const WITHIN: &str = "x1 >= ? AND x0 <= ? AND y1 >= ? AND y0 <= ? AND z1 >= ? AND z0 <= ?";
const FROM_DISTANCE: &str = "(x-?)*(x-?) + (y-?)*(y-?) + (z-?)*(z-?)";
const COVER_DISTANCE: &str = "max(ax-?, ?-bx, 0)*max(ax-?, ?-bx, 0) + max(ay-?, ?-by, 0)*max(ay-?, ?-by, 0) + max(az-?, ?-bz, 0)*max(az-?, ?-bz, 0)";

/// SQL values for [`WITHIN`] and for a squared distance that uses each coordinate `times` times.
fn ball(near: Near, times: usize) -> Vec<Sql> {
    let around =
        near.place_m.iter().flat_map(|p| [Sql::Real(p - near.radius_m), Sql::Real(p + near.radius_m)]);
    let place = near.place_m.iter().flat_map(|p| std::iter::repeat_n(Sql::Real(*p), times));
    around.chain(place).chain([Sql::Real(near.radius_m * near.radius_m)]).collect()
}

fn unsigned(row: &Row, column: usize) -> rusqlite::Result<u64> {
    row.get::<_, i64>(column).map(|v| v.max(0) as u64)
}

fn place(row: &Row) -> rusqlite::Result<Place> {
    let blobs: Vec<u8> = row.get(5)?;
    let located = Located {
        chunk: unsigned(row, 2)?,
        document: Spot { at: unsigned(row, 3)?, crc32: row.get(7)? },
        document_bytes: unsigned(row, 4)?,
        blobs: blobs.as_chunks().0.iter().map(spot).collect(),
        message_bytes: unsigned(row, 6)?,
    };
    Ok(Place { id: RecordId(unsigned(row, 0)?), stamp_ns: row.get(8)?, segment: unsigned(row, 1)?, located })
}

/// Decodes the offset and checksum of a blob.
fn spot(bytes: &[u8; 12]) -> Spot {
    let [a, b, c, d, e, f, g, h, crc32 @ ..] = *bytes;
    Spot { at: u64::from_le_bytes([a, b, c, d, e, f, g, h]), crc32: u32::from_le_bytes(crc32) }
}

fn spots(blobs: &[Spot]) -> Vec<u8> {
    let bytes = |b: &Spot| b.at.to_le_bytes().into_iter().chain(b.crc32.to_le_bytes());
    blobs.iter().flat_map(bytes).collect()
}

/// The ID of a name; a new name is inserted.
fn name_id(
    tx: &Transaction,
    known: &BTreeMap<String, i64>,
    fresh: &mut BTreeMap<String, i64>,
    name: &str,
) -> rusqlite::Result<i64> {
    if let Some(id) = known.get(name).or_else(|| fresh.get(name)) {
        return Ok(*id);
    }
    tx.prepare_cached("INSERT OR IGNORE INTO names(name) VALUES(?1)")?.execute([name])?;
    let id = tx.prepare_cached("SELECT id FROM names WHERE name = ?1")?.query_row([name], |r| r.get(0))?;
    fresh.insert(name.into(), id);
    Ok(id)
}

fn insert_one(
    tx: &Transaction,
    known: &BTreeMap<String, i64>,
    fresh: &mut BTreeMap<String, i64>,
    segment: u64,
    document: &Document,
    l: &Located,
) -> rusqlite::Result<()> {
    let id = document.id.0 as i64;
    let mut name = |name: &str| name_id(tx, known, fresh, name);
    let (kind, frame, robot) = (name(&document.kind)?, name(&document.frame)?, name(&document.robot)?);
    // A record that is found twice was being moved to where it is found last.
    let known_already = tx.prepare_cached("SELECT 1 FROM records WHERE id = ?1")?.exists([id])?;
    if known_already {
        tx.prepare_cached(MOVE)?.execute(params![
            id,
            segment as i64,
            l.chunk as i64,
            l.document.at as i64,
            spots(&l.blobs)
        ])?;
        return Ok(());
    }
    tx.prepare_cached("INSERT INTO records VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)")?
        .execute(params![
            id,
            kind,
            frame,
            robot,
            document.stamp_ns,
            document.end_ns,
            segment as i64,
            l.chunk as i64,
            l.document.at as i64,
            l.document_bytes as i64,
            l.document.crc32,
            spots(&l.blobs),
            l.message_bytes as i64
        ])?;
    tx.prepare_cached("INSERT INTO kinds VALUES(?1, ?2, 1, ?3) ON CONFLICT DO UPDATE SET records = records + 1, bytes = bytes + ?3")?
        .execute(params![kind, frame, l.message_bytes as i64])?;
    for sighting in &document.objects {
        let object = name(&sighting.object)?;
        tx.prepare_cached("INSERT OR IGNORE INTO objects VALUES(?1, ?2, ?3)")?.execute(params![
            object,
            sighting.confidence,
            id
        ])?;
    }
    if let Some([x, y, z]) = document.seen_from_m {
        tx.prepare_cached("INSERT INTO seen_from VALUES(?1, ?2, ?2, ?3, ?3, ?4, ?4, ?2, ?3, ?4)")?
            .execute(params![id, x, y, z])?;
    }
    if let Some(b) = document.covers_m {
        let ([ax, ay, az], [bx, by, bz]) = (b.min_m, b.max_m);
        tx.prepare_cached("INSERT INTO covers VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?2, ?3, ?4, ?5, ?6, ?7)")?
            .execute(params![id, ax, bx, ay, by, az, bz])?;
    }
    Ok(())
}
