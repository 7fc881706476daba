use crate::made::las::Las;
use crate::support::all;
use std::fs;
use voxtile_formats::{ReadOptions, open_clouds};

const US_FOOT_M: f64 = 1200.0 / 3937.0;

/// Returns the units of x, y and of z in metres, derived from the read points, and the remarks.
fn units(las: &Las) -> ([f64; 2], String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    fs::write(&path, las.bytes()).unwrap();
    let options = ReadOptions { scan_period_s: 0.0, ..ReadOptions::default() };
    let mut source = open_clouds(&path, &options).unwrap();
    let (_, points) = all(source.as_mut()).unwrap().remove(0);
    let (read, place) = (points[3].position_m, las.place(3));
    let [x, y, z] = std::array::from_fn(|axis| read[axis] / place[axis]);
    assert!((x / y - 1.0).abs() < 1e-12);
    ([x, z], source.remarks().join("\n"))
}

fn assert_units(las: &Las, wanted: [f64; 2], remark: &str) {
    let (found, remarks) = units(las);
    let is_near = (0..2).all(|k| (found[k] / wanted[k] - 1.0).abs() < 1e-12);
    assert!(is_near && remarks.contains(remark), "{found:?}, not {wanted:?}: {remarks}");
    assert_eq!(remarks.is_empty(), remark.is_empty(), "{remarks}");
}

fn with_wkt(text: &str) -> Las {
    let records = vec![("LASF_Projection", 2112, text.as_bytes().to_vec())];
    Las { encoding: 1 << 4 | 1, records, ..Las::new(4, 6, 10) }
}

fn projected(unit: &str, vertical: &str) -> String {
    format!(
        "COMPD_CS[\"c\",PROJCS[\"a\",GEOGCS[\"b\",UNIT[\"degree\",0.0174532925199433]],UNIT[{unit}]],\
         VERT_CS[\"h\",VERT_DATUM[\"d\",2005],UNIT[{vertical}]]]"
    )
}

/// Files of New Mexico name the survey foot for heights but have the factor of a metre.
#[test]
fn unit_names_override_wrong_factors() {
    let survey = "\"US survey foot\",0.304800609601219";
    let las = with_wkt(&projected(survey, "\"US survey foot\",1.0"));
    assert_units(
        &las,
        [0.304_800_609_601_219, US_FOOT_M],
        "the unit of z is named US survey foot, but has the factor 1:",
    );
    let las = with_wkt(&projected("\"foot\",1", "\"metre\",1"));
    assert_units(
        &las,
        [0.3048, 1.0],
        "the unit of x and y is named foot, but has the factor 1: the name is used, 0.3048 m",
    );
    // A factor close to the named unit is used with all its digits. An unknown name has only its factor.
    let las = with_wkt(&projected("\"Foot_US\",0.3048006", "\"rod\",5.0292"));
    assert_units(&las, [0.304_800_6, 5.0292], "coordinates are converted to metres");
    let las = with_wkt("LOCAL_CS[\"hall\",UNIT[\"millimetre\",0.001]]");
    assert_units(&las, [0.001; 2], "coordinates are converted to metres: x and y times 0.001, z times 0.001");
    assert_units(&with_wkt(&projected("\"metre\",1", "\"Meter\",1")), [1.0; 2], "");
}

/// Returns a file with GeoTIFF keys: key, location of the value, value.
fn with_keys(keys: &[[u16; 3]], doubles: &[f64]) -> Las {
    let mut values = vec![[1, 1, 0, keys.len() as u16]];
    values.extend(keys.iter().map(|[key, place, value]| [*key, *place, 1, *value]));
    let data = values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
    let doubles = doubles.iter().flat_map(|value| value.to_le_bytes()).collect();
    let records = vec![("LASF_Projection", 34735, data), ("LASF_Projection", 34736, doubles)];
    Las { records, ..Las::new(2, 1, 10) }
}

#[test]
fn keys_give_units_by_code_size_and_vertical_system() {
    let metres = "coordinates are converted to metres";
    assert_units(&with_keys(&[[3076, 0, 9003]], &[]), [US_FOOT_M; 2], metres);
    // A user-defined unit size, the second of the doubles.
    let own = [[3076, 0, 32767], [3077, 34736, 1]];
    assert_units(&with_keys(&own, &[7.0, 0.01]), [0.01; 2], metres);
    // NAVD88 heights in metres and in feet, with the projection in the other unit.
    assert_units(&with_keys(&[[3076, 0, 9002], [4096, 0, 5703]], &[]), [0.3048, 1.0], metres);
    assert_units(&with_keys(&[[3076, 0, 9001], [4096, 0, 6360]], &[]), [1.0, US_FOOT_M], metres);
    assert_units(&with_keys(&[[3076, 0, 9001], [4096, 0, 6360], [4099, 0, 9001]], &[]), [1.0; 2], "");
    assert_units(&with_keys(&[[3076, 0, 9999]], &[]), [1.0; 2], "the unit of x and y, EPSG:9999, is unknown");
    assert_units(
        &with_keys(&[[3076, 0, 9001], [4099, 0, 9999]], &[]),
        [1.0; 2],
        "the unit of z, EPSG:9999, is unknown; 1 m is assumed",
    );
}

#[test]
fn coordinates_that_look_like_degrees_or_millimetres_are_remarked() {
    let hint = |las: &Las| units(las).1;
    let degrees = Las { scales: [1e-7, 1e-7, 0.01], offsets: [7.1, 50.7, 60.0], ..Las::new(2, 1, 400) };
    let remark = hint(&degrees);
    assert!(
        remark.starts_with("x and y look like degrees (7.1") && remark.contains("in steps of 0.0000001"),
        "{remark}"
    );
    // Equal steps on all axes: heights in metres too.
    let narrow = Las { scales: [1e-7, 1e-7, 1e-7], offsets: [-77.03, 38.9, 12.0], ..Las::new(2, 1, 400) };
    assert_eq!(hint(&narrow), "", "a small cloud with equal scales gives no hint");
    let millimetres = Las { scales: [1.0; 3], offsets: [0.0; 3], points: 40_000, ..Las::new(2, 0, 40_000) };
    let remark = hint(&millimetres);
    assert!(remark.contains("if they are millimetres or feet"), "{remark}");
    // A file with a named system, and small coordinates in metres, give no hint.
    let named = Las {
        scales: degrees.scales,
        offsets: degrees.offsets,
        ..with_wkt("PROJCS[\"a\",UNIT[\"metre\",1]]")
    };
    assert_eq!(hint(&named), "");
    assert_eq!(hint(&Las { offsets: [7.1, 50.7, 60.0], ..Las::new(2, 1, 400) }), "");
}
