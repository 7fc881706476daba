//! Tests of maps and files in buckets: a store in memory, a faulty store, a web server and a faulty S3 server.

mod city;
mod failing_stores;
mod faulty_store;
mod fetched_files;
mod kept_scans;
mod pushes;
mod s3_server;
mod server;
mod slow_servers;
mod web_server;
