//! A complete batch from kind to results, with a kind that only counts.

use descry_agent::stop::Stop;
use descry_experiments::kinds::kind::{Head, Kind, Summary};
use descry_experiments::*;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Squares numbers; some jobs fail, and some panic.
struct Squares {
    head: Head,
    n: usize,
    done: AtomicUsize,
}

fn squares(n: usize) -> Squares {
    Squares {
        head: Head { name: "squares".into(), kind: "squares".into(), about: "counts".into() },
        n,
        done: AtomicUsize::new(0),
    }
}

impl Kind for Squares {
    fn head(&self) -> &Head {
        &self.head
    }

    fn inputs(&self) -> Vec<(String, String)> {
        vec![("n".into(), self.n.to_string())]
    }

    fn jobs(&self) -> Vec<Job> {
        (0..self.n)
            .map(|k| Job::new([("k", json!(k)), ("parity", json!(if k % 2 == 0 { "even" } else { "odd" }))]))
            .collect()
    }

    fn run(&self, number: usize, scratch: &Path, _stop: &Stop) -> Result<Outcome, String> {
        self.done.fetch_add(1, Ordering::Relaxed);
        std::fs::create_dir_all(scratch).map_err(|e| e.to_string())?;
        match number {
            3 => Err("three is refused".into()),
            5 => panic!("five, \"of all\" numbers"),
            k => {
                let row = json!({ "square": k * k }).as_object().cloned().unwrap_or_default();
                Ok(Outcome { rows: vec![row], clock: Row::new() })
            }
        }
    }

    fn summarise(&self, finished: &[Numbered<'_>]) -> Summary {
        let squares =
            finished.iter().flat_map(|(_, job)| &job.rows).filter_map(|row| row.get("square")?.as_u64());
        let values = json!({ "sum": squares.sum::<u64>() }).as_object().cloned().unwrap_or_default();
        Summary { values, sections: vec![] }
    }
}

fn source() -> Source {
    Source { path: "squares.toml".into(), text: "kind = \"squares\"".into(), assignments: Vec::new() }
}

fn options(out: &Path, shard: Option<Shard>, threads: usize) -> Options {
    Options {
        out: out.to_path_buf(),
        shard,
        merge: vec![],
        threads,
        least_free_bytes: 0,
        stop: Stop::default(),
        tell: |_| (),
    }
}

/// Result files, without the journals.
fn results(folder: &Path) -> BTreeMap<String, String> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    files
        .filter(|path| path.is_file() && !path.ends_with(journal::FILE))
        .map(|path| {
            (
                path.file_name().unwrap_or_default().to_string_lossy().into(),
                std::fs::read_to_string(&path).unwrap_or_default(),
            )
        })
        .collect()
}

type Tested = Result<(), Box<dyn std::error::Error>>;

#[test]
fn failures_and_panics_are_rows() -> Tested {
    let folder = tempfile::tempdir()?;
    let Ended::Whole(whole) = carry_out(&squares(8), &source(), &options(folder.path(), None, 3))? else {
        panic!("all jobs are done")
    };
    assert_eq!(whole.failed, 2);
    assert_eq!(whole.summary["sum"], json!(1 + 4 + 16 + 36 + 49));
    let csv = std::fs::read_to_string(folder.path().join("jobs.csv"))?;
    let expected = "job,k,parity,square,error\nk=0 parity=even,0,even,0,\nk=1 parity=odd,1,odd,1,\nk=2 parity=even,2,even,4,\n\
                    k=3 parity=odd,3,odd,,three is refused\nk=4 parity=even,4,even,16,\n\
                    k=5 parity=odd,5,odd,,\"panic: five, \"\"of all\"\" numbers\"\nk=6 parity=even,6,even,36,\nk=7 parity=odd,7,odd,49,\n";
    assert_eq!(csv, expected);
    assert!(!folder.path().join("scratch").exists(), "what runs leave is removed");
    Ok(())
}

#[test]
fn a_full_disk_ends_it_and_costs_no_job() -> Tested {
    let folder = tempfile::tempdir()?;
    let no_room = Options { least_free_bytes: u64::MAX, ..options(folder.path(), None, 1) };
    let kind = squares(8);
    let ended = carry_out(&kind, &source(), &no_room);
    assert!(
        matches!(&ended, Err(ExperimentError::NoRoom { job, .. }) if job == "k=3 parity=odd"),
        "{ended:?}"
    );
    assert!(kind.done.into_inner() < 8, "nothing is begun on a full disk");
    // With room again, what failed for the want of it is done.
    let kind = squares(8);
    let ended = carry_out(&kind, &source(), &options(folder.path(), None, 1))?;
    assert!(matches!(ended, Ended::Whole(whole) if whole.failed == 2));
    assert_eq!(kind.done.into_inner(), 5, "what was journalled stands");
    Ok(())
}

#[test]
fn shards_and_threads_do_not_show_in_the_results() -> Tested {
    let (whole, parts) = (tempfile::tempdir()?, tempfile::tempdir()?);
    carry_out(&squares(9), &source(), &options(whole.path(), None, 1))?;
    let expected = results(whole.path());
    assert_eq!(expected.keys().collect::<Vec<_>>(), ["index.html", "jobs.csv", "summary.json", "tables.md"]);
    // Each shard on a machine of its own, counted from 1.
    let folders: Vec<PathBuf> = (1..=4).map(|n| parts.path().join(format!("machine-{n}"))).collect();
    for (n, folder) in (1..).zip(&folders) {
        let shard: Shard = format!("{n}/4").parse()?;
        let ended = carry_out(&squares(9), &source(), &options(folder, Some(shard), 2))?;
        assert!(matches!(ended, Ended::Part { all: 9, .. }), "{ended:?}");
    }
    let merged = parts.path().join("merged");
    let merge = |folders: &[PathBuf]| {
        let kind = squares(9);
        let ended =
            carry_out(&kind, &source(), &Options { merge: folders.to_vec(), ..options(&merged, None, 1) });
        assert_eq!(kind.done.into_inner(), 0, "merging does no job");
        ended
    };
    let incomplete = merge(&folders[1..]).map(drop);
    assert!(matches!(incomplete, Err(ExperimentError::Missing { missing: 2, all: 9, .. })), "{incomplete:?}");
    merge(&folders)?;
    assert_eq!(results(&merged), expected);
    // All shards in one folder: a run over it finds everything done.
    let shared = parts.path().join("shared");
    for n in 0..4 {
        carry_out(&squares(9), &source(), &options(&shared, Some(Shard { index: n, of: 4 }), 2))?;
    }
    let kind = squares(9);
    carry_out(&kind, &source(), &options(&shared, None, 2))?;
    assert_eq!((kind.done.into_inner(), results(&shared)), (0, expected));
    Ok(())
}

#[test]
fn goes_on_where_it_was_cut_off() -> Tested {
    let folder = tempfile::tempdir()?;
    carry_out(&squares(9), &source(), &options(folder.path(), None, 2))?;
    let expected = results(folder.path());
    let path = folder.path().join(journal::FILE);
    let lines = std::fs::read_to_string(&path)?;
    let kept: Vec<&str> = lines.split_inclusive('\n').take(5).collect();
    std::fs::write(&path, kept.concat() + "{\"job\": \"k=")?;
    let kind = squares(9);
    carry_out(&kind, &source(), &options(folder.path(), None, 2))?;
    assert_eq!((kind.done.into_inner(), results(folder.path())), (5, expected));
    let another = carry_out(&squares(10), &source(), &options(folder.path(), None, 2)).map(drop);
    assert!(matches!(another, Err(ExperimentError::Another { .. })), "{another:?}");
    Ok(())
}

#[test]
fn shards_are_counted_from_nought_or_one() {
    for (text, expected) in [
        ("0/4", Some(0)),
        ("1/4", Some(1)),
        ("4/4", Some(0)),
        ("5/4", None),
        ("1/0", None),
        ("1", None),
        ("-1/4", None),
        ("a/b", None),
    ] {
        assert_eq!(text.parse::<Shard>().ok().map(|s| s.index), expected, "{text}");
    }
}
