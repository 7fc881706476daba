use super::token::Token;
use std::str::FromStr;
use voxtile::Point;
use voxtile::store::SnapshotName;
use voxtile_render::Layer;
use voxtile_render::levels::{Kind, NodeKey};

/// Resource of a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Route {
    Page(&'static str),
    /// Page without the trailing slash that its relative links need.
    Slash,
    Maps,
    Events,
    Metrics,
    Of(MapId, Thing),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapId {
    pub number: usize,
    pub at: At,
    /// State to compare with.
    pub since: Option<At>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum At {
    Now,
    Snapshot(SnapshotName),
    /// Another map of the list; only to compare with.
    Map(usize),
}

#[derive(Clone, Debug, PartialEq)]
pub enum Thing {
    Tileset,
    Subtree(NodeKey),
    Node(NodeKey, Kind),
    /// Occupied voxels of a node, with the values of a layer.
    LayeredNode(NodeKey, Layer),
    /// List of the changes between two maps.
    Changes,
    /// Ranges and classes of the layers, for legends.
    Layers,
    Query(Point),
    Raycast(Point, Point),
    Trajectory,
    /// Height of the ceiling, and range of the heights.
    Overview,
    /// Points of kept scans that are marked as moving.
    Moving,
    /// Distances to obstacles in the layer of a point, and their cap in metres.
    Distances(Point, f64),
}

impl Route {
    /// Parses a path and a query string; `None` for unknown resources and for a wrong token.
    pub fn of(path: &str, question: Option<&str>, token: &Token) -> Option<Self> {
        let (given, rest) = match path.strip_prefix('/')?.split_once('/') {
            Some((given, rest)) => (given, Some(rest)),
            None => (path.strip_prefix('/')?, None),
        };
        if !token.is(given) {
            return None;
        }
        let Some(rest) = rest else { return Some(Self::Slash) };
        match rest {
            "" | "index.html" => return Some(Self::Page("index.html")),
            "page.js" => return Some(Self::Page("page.js")),
            "page.css" => return Some(Self::Page("page.css")),
            "licences.txt" => return Some(Self::Page("licences.txt")),
            "maps.json" => return Some(Self::Maps),
            "events" => return Some(Self::Events),
            "metrics" => return Some(Self::Metrics),
            _ => {}
        }
        let (id, thing) = rest.strip_prefix("maps/")?.split_once('/')?;
        Some(Self::Of(id.parse().ok()?, Thing::of(thing, question.unwrap_or_default())?))
    }
}

impl Thing {
    /// Returns whether the resource needs points of kept scans or many tiles.
    pub fn reads_much(&self) -> bool {
        matches!(self, Self::Moving | Self::Overview)
    }

    /// Returns whether the resource needs the computation of distances.
    pub fn takes_distances(&self) -> bool {
        matches!(self, Self::Distances(..))
    }

    /// Returns whether the resource needs the levels of a state.
    pub fn takes_levels(&self) -> bool {
        matches!(
            self,
            Self::Tileset
                | Self::Subtree(_)
                | Self::Node(..)
                | Self::LayeredNode(..)
                | Self::Layers
                | Self::Changes
        )
    }

    fn of(path: &str, question: &str) -> Option<Self> {
        let key = |text: &str, extension| text.strip_suffix(extension)?.parse().ok();
        match path {
            "tileset.json" => Some(Self::Tileset),
            "trajectory.json" => Some(Self::Trajectory),
            "overview.json" => Some(Self::Overview),
            "layers.json" => Some(Self::Layers),
            "changes.json" => Some(Self::Changes),
            "moving.bin" => Some(Self::Moving),
            "distances.bin" => {
                let [around, cap_m] = ["at", "cap"].map(|name| field(question, name));
                Some(Self::Distances(point(around?)?, cap_m?.parse().ok()?))
            }
            "query" => {
                let number = |name| field(question, name)?.parse().ok();
                Some(Self::Query(finite([number("x")?, number("y")?, number("z")?])?))
            }
            "raycast" => {
                Some(Self::Raycast(point(field(question, "from")?)?, point(field(question, "to")?)?))
            }
            _ => match path.split_once('/')? {
                ("subtree", rest) => Some(Self::Subtree(key(rest, ".json")?)),
                ("node", rest) => {
                    let key = key(rest, ".vox")?;
                    let layer = field(question, "layer").map(str::parse).transpose().ok()?;
                    Some(match (field(question, "what"), layer) {
                        (None | Some("occupied"), None) => Self::Node(key, Kind::Occupied),
                        (None | Some("occupied"), Some(layer)) => Self::LayeredNode(key, layer),
                        (Some("free"), None) => Self::Node(key, Kind::Free),
                        (Some("unknown"), None) => Self::Node(key, Kind::Unknown),
                        _ => return None,
                    })
                }
                _ => None,
            },
        }
    }
}

/// Parses the version in a query string, `v=0123456789abcdef`.
pub fn version_in(question: &str) -> Option<u64> {
    u64::from_str_radix(field(question, "v")?, 16).ok()
}

/// Returns the value of a name in `a=1&b=2`.
fn field<'a>(question: &'a str, name: &str) -> Option<&'a str> {
    question.split('&').find_map(|part| part.strip_prefix(name)?.strip_prefix('='))
}

/// Parses `X,Y,Z`; the comma may be encoded as `%2C`.
fn point(text: &str) -> Option<Point> {
    let text = text.replace("%2C", ",").replace("%2c", ",");
    let mut numbers = text.split(',').map(|number| number.parse().ok());
    let point = [numbers.next()??, numbers.next()??, numbers.next()??];
    if numbers.next().is_some() { None } else { finite(point) }
}

fn finite(point: Point) -> Option<Point> {
    point.iter().all(|coordinate| coordinate.is_finite()).then_some(point)
}

/// Formats are `0` and `0@monday`, and both with `~monday` for the changes since a snapshot; `1~~0` are the changes from
/// map 0 to map 1.
impl FromStr for MapId {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        if let Some((after, before)) = text.split_once("~~") {
            let [number, before] = [after, before].map(|number| number.parse().map_err(|_| ()));
            return Ok(Self { number: number?, at: At::Now, since: Some(At::Map(before?)) });
        }
        let (state, since) = match text.split_once('~') {
            Some((state, since)) => (state, Some(At::Snapshot(SnapshotName::new(since).map_err(|_| ())?))),
            None => (text, None),
        };
        let (number, at) = match state.split_once('@') {
            Some((number, name)) => (number, At::Snapshot(SnapshotName::new(name).map_err(|_| ())?)),
            None => (state, At::Now),
        };
        Ok(Self { number: number.parse().map_err(|_| ())?, at, since })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn route(path: &str, question: Option<&str>) -> Option<Route> {
        Route::of(path, question, &Token::new("sesame_42").unwrap())
    }

    #[test]
    fn valid_paths_are_parsed() {
        assert_eq!(route("/sesame_42/", None), Some(Route::Page("index.html")));
        assert_eq!(route("/sesame_42", None), Some(Route::Slash));
        assert_eq!(route("/sesame_42/maps.json", None), Some(Route::Maps));
        assert_eq!(route("/sesame_42/metrics", None), Some(Route::Metrics));
        let now = MapId { number: 1, at: At::Now, since: None };
        assert_eq!(
            route("/sesame_42/maps/1/tileset.json", None),
            Some(Route::Of(now.clone(), Thing::Tileset))
        );
        let key = NodeKey { level: 2, index: [0, -1, 3] };
        let node = route("/sesame_42/maps/1/node/2/0/-1/3.vox", Some("v=00ff&what=free"));
        assert_eq!(node, Some(Route::Of(now.clone(), Thing::Node(key, Kind::Free))));
        let node = route("/sesame_42/maps/1/node/2/0/-1/3.vox", Some("v=00ff&layer=class"));
        assert_eq!(node, Some(Route::Of(now.clone(), Thing::LayeredNode(key, Layer::Class))));
        let layers = route("/sesame_42/maps/1/layers.json", None);
        assert_eq!(layers, Some(Route::Of(now.clone(), Thing::Layers)));
        let query = route("/sesame_42/maps/1/query", Some("x=1&y=-2.5&z=3e1"));
        assert_eq!(query, Some(Route::Of(now.clone(), Thing::Query([1.0, -2.5, 30.0]))));
        let ray = route("/sesame_42/maps/1/raycast", Some("from=0,0,0&to=1%2C2,3"));
        assert_eq!(ray, Some(Route::Of(now, Thing::Raycast([0.0; 3], [1.0, 2.0, 3.0]))));
        let overview = route("/sesame_42/maps/0@b/overview.json", None);
        assert!(matches!(overview, Some(Route::Of(_, Thing::Overview))), "{overview:?}");
        let moving = route("/sesame_42/maps/0@b/moving.bin", Some("v=00ff"));
        assert!(matches!(moving, Some(Route::Of(_, Thing::Moving))), "{moving:?}");
        let distances = route("/sesame_42/maps/0/distances.bin", Some("at=1,2,3&cap=0.5"));
        assert!(
            matches!(distances, Some(Route::Of(_, Thing::Distances([1.0, 2.0, 3.0], 0.5)))),
            "{distances:?}"
        );
        let compared = MapId { number: 1, at: At::Now, since: Some(At::Map(0)) };
        let changes = route("/sesame_42/maps/1~~0/changes.json", None);
        assert_eq!(changes, Some(Route::Of(compared, Thing::Changes)));
        let name = |name| At::Snapshot(SnapshotName::new(name).unwrap());
        let since = MapId { number: 0, at: name("b"), since: Some(name("a")) };
        assert_eq!(route("/sesame_42/maps/0@b~a/tileset.json", None), Some(Route::Of(since, Thing::Tileset)));
    }

    #[test]
    fn invalid_paths_are_refused() {
        for path in [
            "",
            "/",
            "//",
            "/sesame_42x/",
            "/sesame_4/maps.json",
            "/maps.json",
            "/metrics",
            "/sesame_42//etc/passwd",
            "/sesame_42/../../etc/passwd",
            "/sesame_42/maps/0/../../../etc/passwd",
            "/sesame_42/maps/0/node/..%2f..%2fetc/passwd",
            "/sesame_42/maps/0@../tileset.json",
            "/sesame_42/maps/0@.hidden/tileset.json",
            "/sesame_42/maps//tileset.json",
            "/sesame_42/maps/1~~/tileset.json",
            "/sesame_42/maps/1~~0~a/tileset.json",
            "/sesame_42/maps/1~~b/tileset.json",
            "/sesame_42/maps/-1/tileset.json",
            "/sesame_42/maps/0/metadata.json",
            "/sesame_42/maps/0/node/0/0/0/0",
            "/sesame_42/maps/0/node/0/0/0/0.vox/",
            "/sesame_42/maps/0/node/99/0/0/0.vox",
            "/sesame_42/page.js/",
        ] {
            assert_eq!(route(path, None), None, "{path}");
        }
        for question in [
            None,
            Some(""),
            Some("x=1&y=2"),
            Some("x=nan&y=0&z=0"),
            Some("x=1e999&y=0&z=0"),
            Some("x=&y=&z="),
        ] {
            assert_eq!(route("/sesame_42/maps/0/query", question), None, "{question:?}");
        }
        for question in ["from=1,2,3", "from=1,2,3&to=1,2", "from=1,2,3&to=1,2,3,4", "from=inf,0,0&to=0,0,0"]
        {
            assert_eq!(route("/sesame_42/maps/0/raycast", Some(question)), None, "{question}");
        }
        for question in ["what=everything", "layer=shape", "layer=", "what=free&layer=colour"] {
            assert_eq!(route("/sesame_42/maps/0/node/0/0/0/0.vox", Some(question)), None, "{question}");
        }
        for question in ["at=1,2,3", "cap=1", "at=nan,0,0&cap=1", "at=1,2,3&cap=x"] {
            assert_eq!(route("/sesame_42/maps/0/distances.bin", Some(question)), None, "{question}");
        }
    }
}
