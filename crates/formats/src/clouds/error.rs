pub use voxtile::{Error, Result};
