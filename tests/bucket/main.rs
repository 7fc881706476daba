//! Maps and files in a bucket: a store in memory, one that fails, a web server.

mod city;
mod failing_stores;
mod faulty_store;
mod fetched_files;
mod pushes;
mod server;
mod web_server;
