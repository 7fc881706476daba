//! Output of `--json`: one-line objects as `voxtile` prints them.

use crate::output;
use serde::Serialize;
use serde_json::{Map, Value, json};
use voxtile::{Error, Place};

/// Version of the field meanings, as in `voxtile`: docs/json.md.
const VERSION: u32 = 1;

#[derive(Serialize)]
struct Versioned<'a, T> {
    version: u32,
    #[serde(flatten)]
    object: &'a T,
}

pub fn print(object: &impl Serialize) -> anyhow::Result<()> {
    Ok(output::print(line(object)?)?)
}

pub fn line(object: &impl Serialize) -> serde_json::Result<String> {
    serde_json::to_string(&Versioned { version: VERSION, object })
}

/// Describes a failure for programs. Fields that do not apply are missing.
pub fn failure(error: &anyhow::Error) -> Value {
    let known = error.downcast_ref::<Error>();
    let mut fields = Map::new();
    fields.insert("kind".to_owned(), known.map_or("other", Error::kind).into());
    fields.insert("message".to_owned(), format!("{error:#}").into());
    if let Some(Error::InvalidArgument { argument, .. }) = known {
        fields.insert("argument".to_owned(), argument.as_str().into());
    }
    if let Some(path) = known.and_then(Error::path) {
        fields.insert("path".to_owned(), path.display().to_string().into());
    }
    if let Some(tile) = known.and_then(Error::tile) {
        fields.insert("tile".to_owned(), json!(tile.to_array()));
    }
    if let Some((place, at)) = known.and_then(Error::place) {
        let name = match place {
            Place::Offset => "offset",
            Place::Line => "line",
            Place::Record => "record",
        };
        fields.insert(name.to_owned(), at.into());
    }
    json!({ "error": fields })
}
