use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Value of a parameter in a file, or a group of values.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
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
