//! Tests of `journal`.

use descry_experiments::header::Header;
use descry_experiments::journal::*;
use descry_experiments::{ExperimentError, Finished};

fn header(hash: &str) -> Header {
    Header { experiment: "e".into(), hash: hash.into(), version: "0".into(), jobs: 3 }
}

fn finished(job: &str) -> Finished {
    Finished { job: job.into(), rows: vec![], clock: serde_json::Map::new(), error: None }
}

#[test]
fn goes_on_after_a_torn_line() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (mut journal, done, _) = Journal::open(folder.path(), &header("a"))?;
    assert!(done.is_empty());
    journal.append(&finished("one"))?;
    journal.append(&finished("two"))?;
    drop(journal);
    let path = folder.path().join(FILE);
    let whole = std::fs::read(&path)?;
    // Whatever the power cut leaves of the second job's line, the first is kept and the second can be written again.
    let second = whole[..whole.len() - 1].iter().rposition(|&b| b == b'\n').unwrap_or(0) + 1;
    for cut in second..whole.len() {
        std::fs::write(&path, &whole[..cut])?;
        let (mut journal, done, unreadable) = Journal::open(folder.path(), &header("a"))?;
        assert_eq!(
            (done.into_keys().collect::<Vec<_>>(), unreadable),
            (vec!["one".to_string()], 0),
            "cut at {cut}"
        );
        journal.append(&finished("two"))?;
        drop(journal);
        assert_eq!(std::fs::read(&path)?, whole);
    }
    Ok(())
}

#[test]
fn a_spoiled_line_costs_one_job() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (mut journal, ..) = Journal::open(folder.path(), &header("a"))?;
    journal.append(&finished("one"))?;
    journal.append(&finished("two"))?;
    drop(journal);
    let path = folder.path().join(FILE);
    let text = std::fs::read_to_string(&path)?.replace(r#"{"job":"one""#, "\0\0\0");
    std::fs::write(&path, text)?;
    let (_, done, unreadable) = Journal::open(folder.path(), &header("a"))?;
    assert_eq!((done.into_keys().collect::<Vec<_>>(), unreadable), (vec!["two".to_string()], 1));
    Ok(())
}

#[test]
fn refuses_what_is_not_its_own() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let (journal, ..) = Journal::open(folder.path(), &header("a"))?;
    let busy = Journal::open(folder.path(), &header("a"));
    assert!(matches!(busy, Err(ExperimentError::Busy { .. })), "{busy:?}");
    drop(journal);
    let another = Journal::open(folder.path(), &header("b")).map(drop);
    let Err(ExperimentError::Another { found, .. }) = another else { panic!("{another:?}") };
    assert_eq!(found.hash, "a");
    std::fs::write(folder.path().join(FILE), "something else\n")?;
    let no_journal = Journal::open(folder.path(), &header("a")).map(drop);
    assert!(matches!(no_journal, Err(ExperimentError::NoJournal { .. })), "{no_journal:?}");
    Ok(())
}
