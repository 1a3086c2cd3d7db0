//! Command-line options for the storage of a run's record.

use descry_agent::keeping::{Keeping, Kept};

/// Options of a run that is recorded.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct KeepingArguments {
    /// Store of the record: `mongodb://HOST[:PORT]/DATABASE[#RUN]`, for a descry built with the feature
    /// mongodb [default: in the run's folder]
    #[arg(long, value_name = "ADDRESS")]
    memory: Option<String>,
    /// Durability of the record: disk (survives a power cut) or process (survives any end of descry; a power
    /// cut costs at most the last segment) [default: disk]
    #[arg(long, value_name = "disk|process")]
    durability: Option<KeptArgument>,
    /// Maximum size of the record, such as 500MB; excess data is pruned oldest first, unless a belief or a
    /// plan rests on it
    #[arg(long, value_name = "SIZE", value_parser = size)]
    max_bytes: Option<u64>,
    /// Maximum age of recorded data, seconds on the body's clock
    #[arg(long, value_name = "S", value_parser = seconds)]
    max_age: Option<f64>,
    /// Minimum free space on the disk, such as 2GB
    #[arg(long, value_name = "SIZE", value_parser = size)]
    min_free: Option<u64>,
}

/// Durability of the record.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum KeptArgument {
    /// Writes are on the disk before they are acknowledged.
    Disk,
    /// Writes are with the operating system before they are acknowledged.
    Process,
}

impl KeepingArguments {
    /// Storage settings of a run.
    pub fn keeping(&self) -> Keeping {
        Keeping {
            memory: self.memory.clone(),
            durability: self.durability.map(|kept| match kept {
                KeptArgument::Disk => Kept::Disk,
                KeptArgument::Process => Kept::Process,
            }),
            max_bytes: self.max_bytes,
            max_age: self.max_age,
            min_free: self.min_free,
        }
    }
}

pub fn size(text: &str) -> Result<u64, String> {
    let units = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12), ("B", 1.0), ("", 1.0)];
    let read = |(unit, factor): (&str, f64)| {
        let number: f64 = text.trim().strip_suffix(unit)?.trim().parse().ok()?;
        (number.is_finite() && number >= 0.0).then_some((number * factor) as u64)
    };
    units.into_iter().find_map(read).ok_or_else(|| format!("`{text}` is no size: write 500MB or 2GB"))
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|s| s.is_finite() && *s >= 0.0);
    number.ok_or_else(|| format!("`{text}` is no number of seconds"))
}
