//! EPSG codes of coordinate reference systems, for formats that store codes.

/// EPSG codes that a coordinate reference system names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct CrsCodes {
    /// The system of x and y.
    pub(crate) flat: Option<FlatCode>,
    /// The system of heights, if it has a code of its own.
    pub(crate) vertical: Option<u16>,
}

/// Code of a system of x and y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FlatCode {
    Projected(u16),
    Geographic(u16),
    Geocentric(u16),
}

/// EPSG codes of geographic and geocentric systems. The latter have metres, as maps do.
const GEODETIC: std::ops::Range<u16> = 4000..5000;
/// First code that GeoTIFF reserves for other uses.
const END: u16 = 32767;

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 3] = ["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS"];
const GEOCENTRIC: [&str; 3] = ["GEOCCS", "GEODCRS", "GEODETICCRS"];
const VERTICAL: [&str; 4] = ["VERT_CS", "VERTCRS", "VERTCS", "VERTICALCRS"];
/// Nodes of other systems, from which those above them are derived.
const BASES: [&str; 6] =
    ["BASEGEOGCRS", "BASEGEODCRS", "BASEPROJCRS", "BASEVERTCRS", "TARGETCRS", "SOURCEEPOCH"];

/// Returns the EPSG code of the system of x and y that a map or a file names, as `EPSG:25832` or as well-known text;
/// `None` if the system has no code.
pub fn epsg_code(crs: &str) -> Option<u16> {
    CrsCodes::of(crs)
        .flat
        .map(|(FlatCode::Projected(code) | FlatCode::Geographic(code) | FlatCode::Geocentric(code))| code)
}

impl CrsCodes {
    /// Returns the codes of a system named as `EPSG:25832`, or of well-known text.
    pub(crate) fn of(crs: &str) -> Self {
        let Some(code) = crs.strip_prefix("EPSG:") else { return Self::of_wkt(crs) };
        let code = code.parse().ok().filter(|code| *code < END);
        let flat = code.map(|code| match GEODETIC.contains(&code) {
            true => FlatCode::Geocentric(code),
            false => FlatCode::Projected(code),
        });
        Self { flat, vertical: None }
    }

    fn of_wkt(wkt: &str) -> Self {
        let mut codes = Self::default();
        let mut nodes: Vec<Node> = Vec::new();
        let (mut word, mut is_quoted) = (String::new(), false);
        for letter in wkt.chars() {
            match letter {
                '"' => is_quoted = !is_quoted,
                _ if is_quoted => word.push(letter),
                '[' | '(' => nodes.push(Node { name: take(&mut word), values: Vec::new() }),
                ',' | ']' | ')' => {
                    let value = take(&mut word);
                    if let Some(node) = nodes.last_mut().filter(|node| node.values.len() < 2) {
                        node.values.push(value);
                    }
                    if letter != ',' {
                        codes.note(&nodes);
                        nodes.pop();
                    }
                }
                _ => word.push(letter),
            }
        }
        codes
    }

    /// Takes the code of the node that ends, if it is one.
    fn note(&mut self, nodes: &[Node]) {
        let [above @ .., of, node] = nodes else { return };
        let is_code = matches!(&*node.name, "AUTHORITY" | "ID");
        let [authority, code] = &node.values[..] else { return };
        let Some(code) = code.parse().ok().filter(|code| *code < END) else { return };
        let is_part = |parts: &[&str]| above.iter().any(|node| parts.contains(&&*node.name));
        if !is_code || authority != "EPSG" || is_part(&BASES) {
            return;
        }
        let is = |names: &[&str]| names.contains(&&*of.name);
        let make = match () {
            () if is(&PROJECTED) => FlatCode::Projected,
            () if is(&GEOGRAPHIC) && !is_part(&PROJECTED) => FlatCode::Geographic,
            () if is(&GEOCENTRIC) && !is_part(&PROJECTED) => FlatCode::Geocentric,
            () => {
                self.vertical = self.vertical.or(is(&VERTICAL).then_some(code));
                return;
            }
        };
        self.flat = self.flat.or(Some(make(code)));
    }
}

/// A node of well-known text that is not complete, with its first two values.
struct Node {
    name: String,
    values: Vec<String>,
}

fn take(word: &mut String) -> String {
    let taken = word.trim().to_ascii_uppercase();
    word.clear();
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(flat: Option<FlatCode>, vertical: Option<u16>) -> CrsCodes {
        CrsCodes { flat, vertical }
    }

    #[test]
    fn codes_are_those_of_the_system_itself() {
        let utm = r#"PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89",DATUM["x",AUTHORITY["EPSG","6258"]],
            AUTHORITY["EPSG","4258"]],PROJECTION["Transverse_Mercator"],UNIT["metre",1,AUTHORITY["EPSG","9001"]],
            AUTHORITY["EPSG","25832"]]"#;
        let newer = r#"PROJCRS["WGS 84 / UTM",BASEGEOGCRS["WGS 84",ID["EPSG",4326]],CONVERSION["a",ID["EPSG",16032]],
            CS[Cartesian,2],LENGTHUNIT["metre",1],ID["EPSG",32632]]"#;
        let height = r#"VERT_CS["DHHN2016",AUTHORITY["EPSG","7837"]]"#;
        let projected = |code| Some(FlatCode::Projected(code));
        let cases = [
            ("EPSG:25832".to_owned(), codes(projected(25832), None)),
            ("EPSG:4978".to_owned(), codes(Some(FlatCode::Geocentric(4978)), None)),
            ("EPSG:102100".to_owned(), CrsCodes::default()),
            (utm.to_owned(), codes(projected(25832), None)),
            (newer.to_owned(), codes(projected(32632), None)),
            (
                format!("COMPD_CS[\"both\",{utm},{height},AUTHORITY[\"EPSG\",\"5555\"]]"),
                codes(projected(25832), Some(7837)),
            ),
            (format!("BOUNDCRS[SOURCECRS[{newer}],TARGETCRS[{utm}]]"), codes(projected(32632), None)),
            (
                r#"GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]]"#.to_owned(),
                codes(Some(FlatCode::Geographic(4326)), None),
            ),
            (
                r#"LOCAL_CS["hall [EPSG",UNIT["metre",1,AUTHORITY["EPSG","9001"]]]"#.to_owned(),
                CrsCodes::default(),
            ),
            (r#"PROJCS["own",GEOGCS["x",AUTHORITY["EPSG","4258"]]]"#.to_owned(), CrsCodes::default()),
            (r#"PROJCS["x",AUTHORITY["ESRI","54009"]]"#.to_owned(), CrsCodes::default()),
            ("]]]((\"AUTHORITY[".to_owned(), CrsCodes::default()),
        ];
        for (crs, expected) in cases {
            assert_eq!(CrsCodes::of(&crs), expected, "{crs}");
        }
    }
}
