//! Job descriptions for clusters: a Slurm job array, or an indexed Kubernetes job. All shards write into one
//! shared folder; the last to finish writes the results, and `--merge` writes them again.

use std::path::{Path, PathBuf};

use descry_agent::shell;

use super::kinds;
use crate::error::ExperimentError;
use crate::kinds::kind::Kind;
use crate::source::Source;

/// Experiment to run on a cluster: number of shards, threads and folder of results.
#[derive(Debug, Clone)]
pub struct Cluster {
    /// Number of shards.
    pub shards: usize,
    /// Number of parallel jobs, and of processors, of each shard.
    pub threads: usize,
    /// Folder of the results, shared by all shards.
    pub out: PathBuf,
}

/// The script of a Slurm job array, for `sbatch`.
///
/// # Errors
/// [`ExperimentError`] if the file is not an experiment, or has fewer jobs than shards.
pub fn slurm(source: &Source, cluster: &Cluster) -> Result<String, ExperimentError> {
    let kind = checked(source, cluster)?;
    let Cluster { shards, threads, out } = cluster;
    let folder = std::path::absolute(".").map_err(|e| ExperimentError::file(Path::new("."), &e))?;
    let (file, out) = (quoted(&source.path), quoted(out));
    Ok(format!(
        r#"#!/bin/bash
# The experiment "{title}" as a Slurm job array: {shards} shards. Submit it where descry, the experiment and the folder of the
# results are found on every node:
#   sbatch THIS-FILE
# The shard that ends last writes the results; to write them again, or to hear what is missing:
#   descry experiment {file} --out {out} --merge {out}
# A shard that was cut off, or asked to make room, goes on where it was when it is submitted again.
#SBATCH --job-name={name}
#SBATCH --array=0-{last}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={threads}
#SBATCH --signal=B:TERM@60
#SBATCH --requeue
#SBATCH --output={name}-%A-%a.log
set -euo pipefail
cd -- {folder}
exec "${{DESCRY:-descry}}" experiment {file} --out {out} \
  --shard "${{SLURM_ARRAY_TASK_ID:?this is for sbatch}}/{shards}" --jobs "${{SLURM_CPUS_PER_TASK:-{threads}}}"
"#,
        title = kind.head().name.replace('\n', " "),
        name = name(&kind.head().name),
        last = shards - 1,
        folder = quoted(&folder),
    ))
}

/// An indexed Kubernetes job that includes the experiment's text, for `kubectl apply`.
///
/// # Errors
/// [`ExperimentError`] if the file is not an experiment, or has fewer jobs than shards.
pub fn kubernetes(source: &Source, cluster: &Cluster) -> Result<String, ExperimentError> {
    let kind = checked(source, cluster)?;
    let Cluster { shards, threads, .. } = cluster;
    let file =
        source.path.file_name().map_or_else(|| "experiment.toml".into(), |name| name.to_string_lossy());
    let run = format!(
        "exec descry experiment \"$EXPERIMENT\" --out \"$RESULTS\" --shard \"$JOB_COMPLETION_INDEX/{shards}\" --jobs {threads}"
    );
    Ok(format!(
        r#"# The experiment {title} as a Kubernetes job: {shards} shards, one a pod.
#   kubectl apply -f THIS-FILE
# To be changed: the image (any that has descry and sh) and the claim of the storage that all pods write the results to. Domains and
# scenes that the experiment names by a path must be found there in the image; built-in ones are within descry.
# The shard that ends last writes the results; where the storage is mounted, they are written again, or it is said what is missing, by
#   descry experiment {file} --out RESULTS --merge RESULTS
apiVersion: v1
kind: ConfigMap
metadata:
  name: {name}
data:
  {file_text}: {text}
---
apiVersion: batch/v1
kind: Job
metadata:
  name: {name}
spec:
  completionMode: Indexed
  completions: {shards}
  parallelism: {shards}
  backoffLimitPerIndex: 3
  template:
    spec:
      restartPolicy: Never
      containers:
        - name: descry
          image: descry:{version}
          command: ["/bin/sh", "-c", {run}]
          env:
            - {{ name: EXPERIMENT, value: {path} }}
            - {{ name: RESULTS, value: /results }}
          resources:
            requests: {{ cpu: "{threads}", memory: 1Gi }}
          volumeMounts:
            - {{ name: experiment, mountPath: /experiment }}
            - {{ name: results, mountPath: /results }}
      volumes:
        - name: experiment
          configMap: {{ name: {name} }}
        - name: results
          persistentVolumeClaim: {{ claimName: descry-results }}
"#,
        title = text(&kind.head().name),
        name = name(&kind.head().name),
        version = env!("CARGO_PKG_VERSION"),
        file_text = text(&file),
        path = text(&format!("/experiment/{file}")),
        text = text(&source.text),
        run = text(&run),
    ))
}

fn checked(source: &Source, cluster: &Cluster) -> Result<Box<dyn Kind>, ExperimentError> {
    let kind = kinds::read(source)?;
    let jobs = kind.jobs().len();
    match cluster.shards {
        shards if (1..=jobs).contains(&shards) => Ok(kind),
        shards => Err(ExperimentError::Shards { shards, jobs }),
    }
}

/// A name that schedulers accept: lower-case letters, digits and hyphens, at most 63 of them.
pub fn name(said: &str) -> String {
    let plain = said.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' });
    let name: String = "descry-".chars().chain(plain).take(63).collect();
    name.trim_end_matches('-').into()
}

/// Quotes a path for the shell.
pub fn quoted(path: &Path) -> String {
    shell::quoted(&path.to_string_lossy())
}

/// Quotes a text for YAML, as in JSON.
pub fn text(said: &str) -> String {
    serde_json::Value::from(said).to_string()
}
