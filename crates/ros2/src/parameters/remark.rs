use log::Level;

/// Message about a parameter. It is logged after parsing, because parameters configure the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    pub level: Level,
    pub text: String,
}

impl Remark {
    pub fn warning(text: String) -> Self {
        Self { level: Level::Warn, text }
    }

    pub fn info(text: String) -> Self {
        Self { level: Level::Info, text }
    }

    pub fn log(&self) {
        log::log!(self.level, "{}", self.text);
    }
}
