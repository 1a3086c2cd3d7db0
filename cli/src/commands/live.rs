//! `--live`: a page that shows what a command does while it does it.

use std::sync::Arc;

use crate::commands::input;
use descry_agent::exit::CommandError;
use descry_pages::live::{Live, Port, Shown};

/// Whether, and where.
#[derive(clap::Args)]
pub struct LiveArguments {
    /// Serve a page that shows it while it goes on, to browsers on this machine alone, and print its address; --live=PORT takes that
    /// port, --live any that is free
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    live: Option<u16>,
}

impl LiveArguments {
    /// Takes the port, if a page was asked for: before anything begins.
    pub fn window(&self) -> Result<Window, CommandError> {
        Ok(Window { port: self.live.map(Port::take).transpose()?, live: None })
    }
}

/// Through which is seen what goes on, if that was asked for.
pub struct Window {
    port: Option<Port>,
    live: Option<Live>,
}

impl Window {
    /// Whether anybody asked to see it.
    pub fn is_wanted(&self) -> bool {
        self.port.is_some()
    }

    /// Begins to show it, and says where.
    pub fn open(&mut self, shown: Arc<dyn Shown>) -> Result<(), CommandError> {
        if let Some(port) = self.port.take() {
            let url = port.url();
            self.live = Some(port.show(shown)?);
            input::narrate(&format!("live      {url}"));
        }
        Ok(())
    }

    /// Lets readers see the end of it.
    pub fn close(self) {
        self.live.into_iter().for_each(Live::end);
    }
}
