use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::net::{Ipv4Addr, SocketAddr};
use std::str::FromStr;

/// Address and port of a server. A port alone is on the loopback interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListenAddress(pub SocketAddr);

impl FromStr for ListenAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let on_loopback = || text.parse().ok().map(|port: u16| (Ipv4Addr::LOCALHOST, port).into());
        let address = text.parse().ok().or_else(on_loopback);
        address
            .map(Self)
            .ok_or_else(|| "give a port or an IP address with a port, such as 127.0.0.1:9464".to_owned())
    }
}

impl fmt::Display for ListenAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Serialize for ListenAddress {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for ListenAddress {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// YAML reads a port as a number.
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected a port, or an address with a port")]
        enum Given {
            Port(u16),
            Text(String),
        }
        match Given::deserialize(deserializer)? {
            Given::Port(port) => Ok(Self((Ipv4Addr::LOCALHOST, port).into())),
            Given::Text(text) => text.parse().map_err(D::Error::custom),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_on_the_loopback_interface() {
        let address = |text: &str| text.parse::<ListenAddress>().map(|address| address.to_string());
        assert_eq!(address("9464").unwrap(), "127.0.0.1:9464");
        assert_eq!(address("0.0.0.0:80").unwrap(), "0.0.0.0:80");
        assert_eq!(address("[::1]:80").unwrap(), "[::1]:80");
        for wrong in ["", "localhost:80", "70000", "1.2.3.4", ":80"] {
            assert!(address(wrong).is_err(), "{wrong}");
        }
        let json: Vec<ListenAddress> = serde_json::from_str("[9464, \"0.0.0.0:80\"]").unwrap();
        assert_eq!(serde_json::to_string(&json).unwrap(), "[\"127.0.0.1:9464\",\"0.0.0.0:80\"]");
    }
}
