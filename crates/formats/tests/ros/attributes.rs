use crate::made::bag1::bag1;
use crate::made::message::{CloudLayout, F32, Field, MessageWriter, U32};
use crate::support::{Cloud, read};
use voxtile::scan::AttributeSet;
use voxtile_formats::ros::{BagOptions, PoseSource};

const U8: u8 = 2;
const U16: u8 = 4;
const BOTH: AttributeSet = AttributeSet { colours: true, classes: true, ..AttributeSet::NONE };

/// Reads clouds with these fields after x, y and z.
fn read_clouds(
    more: &[Field],
    is_big_endian: bool,
    clouds: &[Vec<Vec<u8>>],
    options: BagOptions,
) -> (Vec<Cloud>, Vec<String>) {
    let fields = [&[("x", 0, F32), ("y", 4, F32), ("z", 8, F32)], more].concat();
    let messages = clouds.iter().zip(10..).map(|(points, at)| {
        let point = |rest: &Vec<u8>| {
            let axes = [1.5_f32, 2.5, -0.5];
            let axes = axes.map(|axis| if is_big_endian { axis.to_be_bytes() } else { axis.to_le_bytes() });
            [axes.as_flattened(), rest].concat()
        };
        let (step, data) = (12 + points[0].len() as u32, points.iter().flat_map(point).collect::<Vec<u8>>());
        let size = [1, points.len() as u32];
        let layout = CloudLayout { size, is_big_endian, point_step: step, row_step: step * size[1] };
        (0, at, MessageWriter::ros1().header(5, "lidar").cloud_data(&layout, &fields, &data))
    });
    let messages: Vec<_> = messages.collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    std::fs::write(&path, bag1(&[("/points", "sensor_msgs/PointCloud2")], &messages)).unwrap();
    let (clouds, errors, remarks) = read(&[path], &BagOptions { poses: PoseSource::None, ..options });
    assert_eq!(errors, [""; 0]);
    (clouds, remarks)
}

fn attributes(cloud: &Cloud) -> Vec<(Option<[u8; 3]>, Option<u8>)> {
    cloud.1.iter().map(|point| (point.colour, point.class)).collect()
}

/// Small and large messages, which are read in parts.
#[test]
fn packed_colours_and_labels_are_read() {
    for (name, kind, is_big_endian) in [("rgb", F32, false), ("rgba", U32, true), ("RGB", U32, false)] {
        for count in [3_usize, 70_000] {
            let colour = |k: usize| [k as u8, (k / 256) as u8, 200];
            let class = |k: usize| (k % 256) as u8;
            let point = |k: usize| {
                let [red, green, blue] = colour(k);
                // With an alpha of 255, the float is NaN.
                let bits = u32::from_be_bytes([255, red, green, blue]);
                let (bits, label) = match is_big_endian {
                    true => (bits.to_be_bytes(), u16::from(class(k)).to_be_bytes()),
                    false => (bits.to_le_bytes(), u16::from(class(k)).to_le_bytes()),
                };
                [&bits[..], &label].concat()
            };
            let cloud: Vec<Vec<u8>> = (0..count).map(point).collect();
            let fields = [(name, 12, kind), ("label", 16, U16)];
            let wanted: Vec<_> = (0..count).map(|k| (Some(colour(k)), Some(class(k)))).collect();
            for memory_bytes in [1 << 20, 1 << 28] {
                let options = BagOptions { attributes: BOTH, memory_bytes, ..BagOptions::default() };
                let (clouds, _) = read_clouds(&fields, is_big_endian, std::slice::from_ref(&cloud), options);
                assert_eq!(clouds[0].0.attributes, BOTH);
                assert!(attributes(&clouds[0]) == wanted, "{name} {count} {memory_bytes}");
            }
            let options = BagOptions::default();
            let (clouds, _) = read_clouds(&fields, is_big_endian, std::slice::from_ref(&cloud), options);
            assert!(clouds[0].0.attributes.is_none());
            assert!(attributes(&clouds[0]).iter().all(|point| *point == (None, None)));
        }
    }
}

#[test]
fn scale_and_counts_continue_in_later_clouds() {
    let fields = [("r", 12, F32), ("g", 16, F32), ("b", 20, F32), ("class", 24, U16)];
    let point = |colour: [f32; 3], class: u16| {
        [colour.map(f32::to_le_bytes).as_flattened(), &class.to_le_bytes()].concat()
    };
    let clouds = [vec![point([1.0, 0.5, 0.0], 255)], vec![point([1.0, 0.0, 0.0], 256), point([2.0; 3], 999)]];
    let options = BagOptions { attributes: BOTH, ..BagOptions::default() };
    let (clouds, remarks) = read_clouds(&fields, false, &clouds, options);
    assert_eq!(attributes(&clouds[0]), [(Some([255, 128, 0]), Some(255))]);
    assert_eq!(attributes(&clouds[1]), [(Some([255, 0, 0]), None), (None, None)]);
    for wanted in ["from 0 to 1,", "1 points have a colour outside", "2 points have a class number"] {
        assert!(remarks.iter().any(|remark| remark.contains(wanted)), "{remarks:?}");
    }
}

/// A field outside of the point, and a packed colour of another size, are not there.
#[test]
fn unusable_fields_are_not_attributes() {
    let fields = [("rgb", 12, U16), ("label", 13, U16), ("class", 12, U8)];
    let options = BagOptions { attributes: BOTH, ..BagOptions::default() };
    let (clouds, _) = read_clouds(&fields, false, &[vec![vec![7, 7]]], options);
    assert_eq!(attributes(&clouds[0]), [(None, Some(7))]);
}
