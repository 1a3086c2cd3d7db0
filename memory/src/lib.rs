//! What was seen and what is believed.
