//! Processes that share maps over loopback, some over a lossy link: their digests are equal at the end.

mod support;

use std::process::{Command, Stdio};
use std::time::Duration;
use support::bad_link::BadLink;
use support::{Process, SHARE, endpoint, layers_of, publisher, run, scans, set_of, start, subscriber};
use tempfile::TempDir;

#[test]
fn two_processes_share_a_set_and_fold_the_layer_into_a_map() {
    let folder = TempDir::new().unwrap();
    let (endpoint, map) = (endpoint(), folder.path().join("map"));
    let subscriber = subscriber(&map, &[&endpoint], &["--until-equal", "--for", "120"]);
    let mut publisher = publisher("spotter", &scans(folder.path(), 1, 40), &endpoint);
    let (voxels, digest) = set_of(&mut publisher);
    assert!(voxels > 1000);
    // The first subscriber may have stopped before the last scan, if the sets were equal for three seconds. A second
    // one runs after the last scan.
    drop(subscriber);
    let again = self::subscriber(&map, &[&endpoint], &["--until-equal", "--for", "120"]);
    assert_eq!(layers_of(&mut { again }), [("spotter".to_string(), voxels, digest, true)]);
    let map = voxtile::MapReader::open(&map, 16 << 20).unwrap();
    assert_eq!(voxtile::MapQueries::all_occupied_voxels(&map, None).unwrap().len() as u64, voxels);
}

#[test]
fn four_processes_agree_despite_a_lossy_link_that_is_cut() {
    let folder = TempDir::new().unwrap();
    let robots = [endpoint(), endpoint()];
    let link = endpoint();
    let mut publishers = [("a", 11, &robots[0]), ("b", 12, &robots[1])]
        .map(|(name, seed, endpoint)| publisher(name, &scans(folder.path(), seed, 60), endpoint));
    let bad = BadLink {
        seed: 5,
        loss: 0.2,
        repetition: 0.1,
        max_delay: Duration::from_millis(300),
        cut_from: Duration::from_millis(1500),
        cut_for: Duration::from_secs(4),
    };
    bad.start(&link, &[&robots[0], &robots[1]]);
    let sets = publishers.each_mut().map(set_of);
    let maps = ["x", "y"].map(|name| folder.path().join(name));
    let subscribers = maps.each_ref().map(|map| {
        subscriber(map, &[&link], &["--robot", "a", "--robot", "b", "--until-equal", "--for", "150"])
    });
    for subscriber in subscribers {
        let layers = layers_of(&mut { subscriber });
        assert_eq!(layers.len(), 2, "{layers:?}");
        for ((robot, voxels, digest, is_equal), (name, set)) in
            layers.into_iter().zip(["a", "b"].iter().zip(&sets))
        {
            assert_eq!((robot.as_str(), voxels, &digest, is_equal), (*name, set.0, &set.1, true));
        }
    }
}

#[test]
fn both_sides_recover_from_a_kill() {
    let folder = TempDir::new().unwrap();
    let (robot, link, map) = (endpoint(), endpoint(), folder.path().join("map"));
    let scans = scans(folder.path(), 21, 60);
    let bad = BadLink {
        seed: 6,
        loss: 0.1,
        repetition: 0.1,
        max_delay: Duration::from_millis(100),
        cut_from: Duration::ZERO,
        cut_for: Duration::ZERO,
    };
    bad.start(&link, &[&robot]);
    let first = publisher("r", &scans, &robot);
    let listening = subscriber(&map, &[&link], &["--for", "150"]);
    std::thread::sleep(Duration::from_secs(2));
    // Kill both in the middle.
    drop(first);
    drop(listening);
    let mut second = publisher("r", &scans, &robot);
    let listening = subscriber(&map, &[&link], &["--for", "150"]);
    std::thread::sleep(Duration::from_secs(1));
    drop(listening);
    let (voxels, digest) = set_of(&mut second);
    let listening = subscriber(&map, &[&link], &["--until-equal", "--for", "150", "--keep-apart"]);
    assert_eq!(layers_of(&mut { listening }), [("r".to_string(), voxels, digest, true)]);
    assert!(!map.exists());
    let layer = folder.path().join("map.layers/r.layer");
    let folded = run(&["--fold", layer.to_str().unwrap(), "-o", map.to_str().unwrap(), "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&folded.stdout).unwrap();
    assert_eq!(report["hits"].as_u64(), Some(voxels));
}

/// A robot without a certificate of the fleet receives nothing.
#[test]
fn only_robots_with_a_certificate_of_the_fleet_share_over_tls() {
    let folder = TempDir::new().unwrap();
    let (fleet, other_fleet) = (Fleet::new(), Fleet::new());
    let config = |name: &str, own: &Fleet| {
        let (certificate, key) = own.robot(name);
        let file = |kind: &str, text: String| {
            let path = folder.path().join(format!("{name}.{kind}"));
            std::fs::write(&path, text).unwrap();
            path
        };
        let (certificate, key) = (file("cert.pem", certificate), file("key.pem", key));
        let ca = file("ca.pem", fleet.certificate.clone());
        let tls = serde_json::json!({
            "root_ca_certificate": ca, "enable_mtls": true,
            "listen_certificate": certificate, "listen_private_key": key,
            "connect_certificate": certificate, "connect_private_key": key,
        });
        let config = serde_json::json!({ "transport": { "link": { "tls": tls } } });
        file("json5", config.to_string()).to_str().unwrap().to_string()
    };
    let endpoint = endpoint().replace("tcp/127.0.0.1", "tls/localhost");
    let scans = scans(folder.path(), 31, 10);
    let args = ["--publish", scans.to_str().unwrap(), "--robot", "spotter", "--listen", &endpoint, "--json"];
    let spotter = config("spotter", &fleet);
    let mut publisher = start(
        SHARE,
        &[&args[..], &["--rate", "20", "--latency", "0.2", "--zenoh-config", &spotter]].concat(),
    );
    let set = set_of(&mut publisher);
    let received = |config: &str, seconds: &str| {
        let map = folder.path().join("map");
        let more = ["--zenoh-config", config, "--until-equal", "--for", seconds, "--keep-apart"];
        layers_of(&mut subscriber(&map, &[&endpoint], &more))
    };
    assert_eq!(received(&config("intruder", &other_fleet), "4"), []);
    assert_eq!(received(&config("friend", &fleet), "120"), [("spotter".to_string(), set.0, set.1, true)]);
}

/// Certificate authority and its members.
struct Fleet {
    issuer: rcgen::Issuer<'static, rcgen::KeyPair>,
    certificate: String,
}

impl Fleet {
    fn new() -> Self {
        let mut params = rcgen::CertificateParams::new(Vec::<String>::new()).unwrap();
        params.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
        let key = rcgen::KeyPair::generate().unwrap();
        let certificate = params.self_signed(&key).unwrap().pem();
        Self { issuer: rcgen::Issuer::new(params, key), certificate }
    }

    /// Certificate and key of a robot, as PEM.
    fn robot(&self, name: &str) -> (String, String) {
        let names = vec![name.to_string(), "localhost".to_string()];
        let params = rcgen::CertificateParams::new(names).unwrap();
        let key = rcgen::KeyPair::generate().unwrap();
        (params.signed_by(&key, &self.issuer).unwrap().pem(), key.serialize_pem())
    }
}

#[test]
fn errors_on_the_command_line_are_reported() {
    for (args, word) in [
        (vec!["--publish", "x", "--robot", "a/b"], "robot's name"),
        (vec!["--publish", "/nowhere", "--robot", "a"], "/nowhere"),
        (vec!["--publish", "x"], "--robot"),
        (vec!["--subscribe"], "-o"),
        (vec!["--publish", "x", "--subscribe"], "cannot be used with"),
        (vec!["--fold", "/nowhere.layer", "-o", "/nowhere"], "/nowhere.layer"),
    ] {
        let output = run(&args);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && stderr.contains(word), "{args:?}: {stderr}");
    }
}

/// A closed output, for example to `head`, must not prevent folding.
#[test]
fn all_layers_are_folded_if_the_output_is_closed() {
    let folder = TempDir::new().unwrap();
    let (robots, map) = ([endpoint(), endpoint()], folder.path().join("map"));
    let mut publishers = [("a", 41, &robots[0]), ("b", 42, &robots[1])]
        .map(|(name, seed, endpoint)| publisher(name, &scans(folder.path(), seed, 10), endpoint));
    let sets = publishers.each_mut().map(set_of);
    let mut command = Command::new(SHARE);
    command.args(["--subscribe", "-o", map.to_str().unwrap(), "--json", "--for", "10"]);
    command.args(robots.iter().flat_map(|robot| ["--connect", robot]));
    let mut subscriber = Process(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
    drop((subscriber.0.stdout.take(), subscriber.0.stderr.take()));
    assert!(subscriber.0.wait().unwrap().success());
    for (name, (voxels, _)) in ["a", "b"].into_iter().zip(sets) {
        let layer = folder.path().join(format!("map.layers/{name}.layer"));
        let again = run(&["--fold", layer.to_str().unwrap(), "-o", map.to_str().unwrap(), "--json"]);
        let report: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
        assert_eq!((report["voxels"].as_u64(), report["hits"].as_u64()), (Some(voxels), Some(0)), "{name}");
    }
}
