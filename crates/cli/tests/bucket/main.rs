//! Maps and files in a bucket: a store in memory, one that fails, a web server, an S3 server that
//! makes trouble.

mod city;
mod failing_stores;
mod faulty_store;
mod fetched_files;
mod pushes;
mod s3_server;
mod server;
mod slow_servers;
mod web_server;
