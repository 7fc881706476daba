use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::str::FromStr;
use voxtile::Layers;

/// Layers of a new map: a text such as `colour,intensity=65535`, or in a file also a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerList(pub Layers);

impl FromStr for LayerList {
    type Err = voxtile::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self)
    }
}

impl Serialize for LayerList {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(layers) = self;
        let names = layers.names().map(|name| match layers.intensity_max.filter(|_| name == "intensity") {
            Some(max) => format!("{name}={max}"),
            None => name.to_owned(),
        });
        names.collect::<Vec<_>>().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for LayerList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected a string or a list of strings")]
        enum Names {
            Text(String),
            List(Vec<String>),
        }
        let text = match Names::deserialize(deserializer)? {
            Names::Text(text) => text,
            Names::List(names) if names.is_empty() => "none".to_owned(),
            Names::List(names) => names.join(","),
        };
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_texts_or_lists() {
        for text in ["none", "colour", "intensity=0.1,shape", "colour,intensity,class,time,shape"] {
            let layers: LayerList = text.parse().unwrap();
            let json = serde_json::to_value(layers).unwrap();
            assert_eq!(serde_json::from_value::<LayerList>(json).unwrap(), layers);
            assert_eq!(serde_json::from_value::<LayerList>(text.into()).unwrap(), layers);
        }
        for wrong in ["colors", "intensity=x", "intensity=0"] {
            assert!(wrong.parse::<LayerList>().is_err(), "{wrong}");
        }
    }
}
