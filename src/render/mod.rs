//! Maps to look at: levels of detail for viewers. Behind the feature `render`; nothing here knows the web or a screen.

pub mod levels;
