use serde::Deserialize;
use std::collections::BTreeMap;

/// What a parameter may be in a file, or a group of them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Value {
    Bool(bool),
    Whole(i64),
    Number(f64),
    Text(String),
    List(Vec<Value>),
    Group(BTreeMap<String, Value>),
    Nothing(()),
}

impl Value {
    /// As it is written on a command line; `None` for what is no single value.
    pub fn text(&self) -> Option<String> {
        match self {
            Self::Bool(value) => Some(value.to_string()),
            Self::Whole(value) => Some(value.to_string()),
            Self::Number(value) => Some(value.to_string()),
            Self::Text(value) => Some(value.clone()),
            Self::List(_) | Self::Group(_) | Self::Nothing(()) => None,
        }
    }
}
