use futures_util::TryStreamExt;
use std::sync::Arc;
use tokio::runtime::Runtime;
use voxtile_bucket::Bucket;
use voxtile_bucket::object_store::memory::InMemory;
use voxtile_bucket::object_store::path::Path as Key;
use voxtile_bucket::object_store::{ObjectStore, ObjectStoreExt};

/// Store in memory with methods for tests.
pub struct Server {
    pub store: Arc<InMemory>,
    runtime: Runtime,
}

impl Server {
    pub fn new() -> Self {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        Self { store: Arc::new(InMemory::new()), runtime }
    }

    pub fn bucket(&self) -> Bucket {
        Bucket::on(self.store.clone(), "maps/city", "s3://test/maps/city").unwrap()
    }

    pub fn keys(&self) -> Vec<Key> {
        let listed = self.store.list(None).map_ok(|object| object.location).try_collect();
        let mut keys: Vec<Key> = self.runtime.block_on(listed).unwrap();
        keys.sort();
        keys
    }

    pub fn objects(&self) -> Vec<Key> {
        self.keys().into_iter().filter(|key| key.as_ref().contains("objects/")).collect()
    }

    pub fn get(&self, key: &Key) -> Vec<u8> {
        self.runtime.block_on(async { self.store.get(key).await.unwrap().bytes().await.unwrap().to_vec() })
    }

    pub fn put(&self, key: &Key, content: Vec<u8>) {
        self.runtime.block_on(self.store.put(key, content.into())).unwrap();
    }

    pub fn delete(&self, key: &Key) {
        self.runtime.block_on(self.store.delete(key)).unwrap();
    }
}
