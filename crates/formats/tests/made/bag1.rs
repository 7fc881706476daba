/// Message of a bag: its topic index, recording time and data.
pub type BagMessage = (usize, i64, Vec<u8>);

/// Encodes a ROS 1 bag with an index: topics with their types, and messages in one uncompressed chunk.
pub fn bag1(topics: &[(&str, &str)], messages: &[BagMessage]) -> Vec<u8> {
    let connections: Vec<Vec<u8>> = topics.iter().zip(0..).map(|(topic, id)| connection(id, topic)).collect();
    let mut contents = connections.concat();
    for (topic, log_ns, data) in messages {
        let head =
            [field("op", &[2]), field("conn", &(*topic as u32).to_le_bytes()), field("time", &time(*log_ns))];
        contents.extend(record(&head, data));
    }
    let size = field("size", &(contents.len() as u32).to_le_bytes());
    let chunk = record(&[field("op", &[5]), field("compression", b"none"), size], &contents);
    let times = || messages.iter().map(|message| message.1);
    let mut counts = vec![0_u32; topics.len()];
    messages.iter().for_each(|message| counts[message.0] += 1);
    let counts: Vec<u8> = counts
        .iter()
        .zip(0_u32..)
        .flat_map(|(count, id)| [id.to_le_bytes(), count.to_le_bytes()].concat())
        .collect();
    let head = |index_at: u64| {
        let [chunks, connections] = [1, topics.len() as u32].map(u32::to_le_bytes);
        let fields = [
            field("op", &[3]),
            field("index_pos", &index_at.to_le_bytes()),
            field("conn_count", &connections),
            field("chunk_count", &chunks),
        ];
        [b"#ROSBAG V2.0\n".to_vec(), record(&fields, b" ")].concat()
    };
    let chunk_at = head(0).len() as u64;
    let info = [
        field("op", &[6]),
        field("ver", &1_u32.to_le_bytes()),
        field("chunk_pos", &chunk_at.to_le_bytes()),
        field("start_time", &time(times().min().unwrap_or(0))),
        field("end_time", &time(times().max().unwrap_or(0))),
        field("count", &(topics.len() as u32).to_le_bytes()),
    ];
    let head = head(chunk_at + chunk.len() as u64);
    [head, chunk, connections.concat(), record(&info, &counts)].concat()
}

fn connection(id: u32, (topic, type_name): &(&str, &str)) -> Vec<u8> {
    let head = [field("op", &[7]), field("conn", &id.to_le_bytes()), field("topic", topic.as_bytes())];
    record(&head, &[field("topic", topic.as_bytes()), field("type", type_name.as_bytes())].concat())
}

fn record(head: &[Vec<u8>], data: &[u8]) -> Vec<u8> {
    let head = head.concat();
    [&(head.len() as u32).to_le_bytes(), &head[..], &(data.len() as u32).to_le_bytes(), data].concat()
}

fn field(name: &str, value: &[u8]) -> Vec<u8> {
    let length = (name.len() + 1 + value.len()) as u32;
    [&length.to_le_bytes(), name.as_bytes(), b"=", value].concat()
}

fn time(ns: i64) -> Vec<u8> {
    [ns / 1_000_000_000, ns % 1_000_000_000].map(|part| (part as u32).to_le_bytes()).concat()
}
