use super::recording::{Message, Recording, Topic, TopicList};
use super::wire::Wire;
use crate::error::{Error, Place, Result};
use rusqlite::{Connection, OpenFlags};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A `.db3` of ROS 2: a database of SQLite, which is opened for reading only.
///
/// Messages come in order of the time at which they were recorded. Memory holds 24 bytes for each of them.
#[derive(Debug)]
pub struct Db3 {
    database: Database,
    topics: TopicList,
    /// The topic of a number in the file.
    numbers: HashMap<i64, usize>,
    places: Vec<RowPlace>,
    next: usize,
    remarks: Vec<String>,
}

#[derive(Debug)]
struct Database {
    path: PathBuf,
    /// `None` while it is closed.
    connection: Option<Connection>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct RowPlace {
    log_ns: i64,
    id: i64,
    topic: usize,
}

impl Db3 {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no such database.
    pub fn open(path: &Path) -> Result<Self> {
        // SQLite would say the same of a file that is missing and of one that is no database.
        std::fs::File::open(path).map_err(|error| Error::io(path, "read", error))?;
        let mut db3 = Self {
            database: Database { path: path.to_owned(), connection: None },
            topics: TopicList::default(),
            numbers: HashMap::new(),
            places: Vec::new(),
            next: 0,
            remarks: Vec::new(),
        };
        db3.read_topics().map_err(|error| wrong(path, 0, &error))?;
        if let Err(error) = db3.count() {
            db3.remarks.push(format!("{}: messages cannot be counted: {error}", path.display()));
        }
        Ok(db3)
    }

    fn read_topics(&mut self) -> rusqlite::Result<()> {
        let mut statement = self
            .database
            .open()?
            .prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (name, type_name, encoding): (String, String, String) =
                (row.get(1)?, row.get(2)?, row.get(3)?);
            let wire = match encoding.as_str() {
                "cdr" => Some(Wire::Cdr),
                "ros1" => Some(Wire::Ros1),
                _ => None,
            };
            self.numbers.insert(row.get(0)?, self.topics.index(&name, &type_name, wire));
        }
        Ok(())
    }

    fn count(&mut self) -> rusqlite::Result<()> {
        let mut statement =
            self.database.open()?.prepare("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (number, count): (i64, i64) = (row.get(0)?, row.get(1)?);
            if let Some(&topic) = self.numbers.get(&number) {
                self.topics.count(topic, u64::try_from(count).unwrap_or(0));
            }
        }
        Ok(())
    }

    /// Finds the rows of topics; those before an error stay.
    fn find_rows(&mut self, topics: &[usize]) -> rusqlite::Result<()> {
        if topics.is_empty() {
            return Ok(());
        }
        let mut statement = self.database.open()?.prepare("SELECT id, topic_id, timestamp FROM messages")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (id, number, log_ns): (i64, i64, i64) = (row.get(0)?, row.get(1)?, row.get(2)?);
            if let Some(&topic) = self.numbers.get(&number).filter(|topic| topics.contains(topic)) {
                self.places.push(RowPlace { log_ns, id, topic });
            }
        }
        Ok(())
    }
}

impl Database {
    fn open(&mut self) -> rusqlite::Result<&Connection> {
        let connection = match self.connection.take() {
            Some(connection) => connection,
            None => {
                let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
                Connection::open_with_flags(&self.path, flags)?
            }
        };
        Ok(self.connection.insert(connection))
    }
}

impl Recording for Db3 {
    fn format(&self) -> &str {
        "ROS 2 bag (SQLite)"
    }

    fn topics(&self) -> &[Topic] {
        &self.topics.topics
    }

    fn begin(&mut self, topics: &[usize]) -> Result<()> {
        self.next = 0;
        self.places.clear();
        let found = self.find_rows(topics);
        self.places.sort_unstable();
        if let Err(error) = found {
            let (path, found) = (self.database.path.display(), self.places.len());
            let remark = format!("{path} is damaged ({error}): {found} messages were found before that");
            if !self.remarks.contains(&remark) {
                self.remarks.push(remark);
            }
        }
        Ok(())
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        let Some(&RowPlace { log_ns, id, topic }) = self.places.get(self.next) else { return Ok(None) };
        self.next += 1;
        let data = self
            .database
            .open()
            .and_then(|database| database.prepare_cached("SELECT data FROM messages WHERE id = ?1"))
            .and_then(|mut statement| statement.query_row([id], |row| row.get(0)));
        let data =
            data.map_err(|error| wrong(&self.database.path, u64::try_from(id).unwrap_or(0), &error))?;
        Ok(Some(Message { topic, log_ns, data }))
    }

    fn close_files(&mut self) {
        self.database.connection = None;
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }
}

fn wrong(path: &Path, row: u64, error: &rusqlite::Error) -> Error {
    Error::format(path, Place::Record(row), format!("it cannot be read as a bag of ROS 2: {error}"))
}
