//! `--live`: a live page of the command's work.

use std::sync::Arc;

use crate::commands::input;
use descry_agent::exit::CommandError;
use descry_pages::live::{Live, Port, Shown};

/// Options for a live page.
#[derive(clap::Args)]
pub struct LiveArguments {
    /// Serve a live page to browsers on this machine alone, and print its address; --live=PORT takes that
    /// port, --live any free one
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    live: Option<u16>,
}

impl LiveArguments {
    /// Binds the port, if a page was requested, before any work begins.
    pub fn window(&self) -> Result<Window, CommandError> {
        Ok(Window { port: self.live.map(Port::take).transpose()?, live: None })
    }
}

/// Live page, if one was requested.
pub struct Window {
    port: Option<Port>,
    live: Option<Live>,
}

impl Window {
    /// True if a page was requested.
    pub fn is_wanted(&self) -> bool {
        self.port.is_some()
    }

    /// Starts to serve the page, and prints its address.
    pub fn open(&mut self, shown: Arc<dyn Shown>) -> Result<(), CommandError> {
        if let Some(port) = self.port.take() {
            let url = port.url();
            self.live = Some(port.show(shown)?);
            input::narrate(&format!("live      {url}"));
        }
        Ok(())
    }

    /// Lets readers fetch the final state, and stops serving.
    pub fn close(self) {
        self.live.into_iter().for_each(Live::end);
    }
}
