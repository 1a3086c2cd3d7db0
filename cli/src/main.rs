//! `descry`: the command line, a stable interface for scripts.

use std::process::ExitCode;

use descry_agent::exit::Exit;
use descry_agent::stop::Stop;
use descry_cli::commands;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Allocator that keeps freed memory for reuse: each merge allocates and frees tens of megabytes.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        commands::narrate(&format!(
            "descry: {panic}\n  this is a bug of descry; please report it with the command and its input"
        ));
    }));
    warn_people();
    commands::heed_limits();
    let outcome = std::panic::catch_unwind(|| {
        let command = commands::asked();
        let stop = Stop::default();
        if command.can_be_stopped() {
            listen(&stop);
        }
        commands::run(&command, &stop)
    });
    match outcome {
        Ok(Ok(exit)) => exit.into(),
        Ok(Err(error)) => {
            commands::narrate_fitted(&format!("descry: {error}"));
            error.exit().into()
        }
        Err(_) => Exit::Bug.into(),
    }
}

/// Translates signals to stop requests; a second Ctrl-C ends the program at once.
fn listen(stop: &Stop) {
    let stop = stop.clone();
    let thread = std::thread::Builder::new().name("signals".into());
    if let Err(e) = thread.spawn(move || hear(&stop)) {
        tracing::warn!("Ctrl-C will end the program at once: {e}");
    }
}

fn hear(stop: &Stop) -> std::io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build()?;
    runtime.block_on(async {
        let mut interrupt = signal(SignalKind::interrupt())?;
        let mut terminate = signal(SignalKind::terminate())?;
        let mut hangup = signal(SignalKind::hangup())?;
        loop {
            let (by, kind) = tokio::select! {
                _ = interrupt.recv() => (2, "Ctrl-C"),
                _ = terminate.recv() => (15, "SIGTERM"),
                _ = hangup.recv() => (1, "the end of the terminal"),
            };
            if !stop.is_asked() {
                stop.ask(by);
                commands::narrate(&format!("descry: {kind}: stopping; Ctrl-C again ends at once"));
            } else if by == 2 {
                std::process::exit(i32::from(Exit::Interrupted as u8));
            }
        }
    })
}

/// Prints warnings on standard error; `RUST_LOG` sets the level.
fn warn_people() {
    let asked = std::env::var("RUST_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let filter = asked.unwrap_or_else(|| Targets::new().with_default(LevelFilter::WARN));
    // It would panic over what it cannot write, as to a full disk.
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).log_internal_errors(false);
    let lines = lines.with_ansi(commands::is_coloured()).without_time().with_target(false);
    tracing_subscriber::registry().with(lines.with_filter(filter)).init();
}
