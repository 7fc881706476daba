use super::message_data::MessageData;
use super::recording::{Message, Recording, Topic, TopicList, TopicSet};
use super::wire::Wire;
use crate::spill::{Budget, Record, Sorted, Sorter, SpillFile, StreamSize};
use rusqlite::limits::Limit;
use rusqlite::{Connection, MAIN_DB, OpenFlags};
use std::cmp::Ordering;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// ROS 2 bag in a SQLite database (`.db3`), opened read-only.
///
/// Messages are returned in order of their recording time. If there are many, their locations are in a temporary file.
#[derive(Debug)]
pub struct Db3 {
    database: Database,
    topics: TopicList,
    /// Topics by their ID in the file.
    numbers: HashMap<i64, usize>,
    /// Locations of the remaining messages.
    places: Option<Sorted<RowPlace>>,
    spill: SpillFile,
    remarks: Vec<String>,
}

#[derive(Debug)]
struct Database {
    path: PathBuf,
    /// `None` while the database is closed.
    connection: Option<Connection>,
    /// Limit for a column value, in bytes.
    max_bytes: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct RowPlace {
    log_ns: i64,
    id: i64,
    topic: usize,
}

impl Record for RowPlace {
    const BYTES: usize = 24;

    fn encode(&self, bytes: &mut [u8]) {
        let numbers = [self.log_ns.cast_unsigned(), self.id.cast_unsigned(), self.topic as u64];
        for (to, from) in bytes.iter_mut().zip(numbers.into_iter().flat_map(u64::to_le_bytes)) {
            *to = from;
        }
    }

    fn decode(bytes: &[u8]) -> Self {
        let (numbers, _) = bytes.as_chunks::<8>();
        let number = |k: usize| numbers.get(k).copied().map_or(0, u64::from_le_bytes);
        let topic = usize::try_from(number(2)).unwrap_or(usize::MAX);
        Self { log_ns: number(0).cast_signed(), id: number(1).cast_signed(), topic }
    }

    fn order(&self, other: &Self) -> Ordering {
        self.cmp(other)
    }
}

impl Db3 {
    /// Opens a bag.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is not such a database.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, &Budget::default())
    }

    /// As [`Db3::open`], within a memory budget.
    ///
    /// # Errors
    ///
    /// As for [`Db3::open`].
    pub fn open_within(path: &Path, budget: &Budget) -> Result<Self> {
        // SQLite reports a missing file like a file that is not a database.
        std::fs::File::open(path).map_err(|error| Error::io(path, "read", error))?;
        let mut db3 = Self {
            database: Database { path: path.to_owned(), connection: None, max_bytes: budget.whole_bytes() },
            topics: TopicList::default(),
            numbers: HashMap::new(),
            places: None,
            spill: SpillFile::new(budget),
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
            if let Some(topic) = self.topics.index(&name, &type_name, wire) {
                self.numbers.insert(row.get(0)?, topic);
            }
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

    /// Finds the rows of topics. Rows found before an error are kept. The inner error is that of a temporary file.
    fn find_rows(
        &mut self,
        topics: &TopicSet,
        places: &mut Sorter<RowPlace>,
        found: &mut u64,
    ) -> rusqlite::Result<Result<()>> {
        if topics.is_empty() {
            return Ok(Ok(()));
        }
        let mut statement = self.database.open()?.prepare("SELECT id, topic_id, timestamp FROM messages")?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            let (id, number, log_ns): (i64, i64, i64) = (row.get(0)?, row.get(1)?, row.get(2)?);
            if let Some(&topic) = self.numbers.get(&number).filter(|topic| topics.contains(**topic)) {
                if let Err(error) = places.push(RowPlace { log_ns, id, topic }) {
                    return Ok(Err(error));
                }
                *found += 1;
            }
        }
        Ok(Ok(()))
    }

    /// Reads the bytes of a message; a large one is copied to a file.
    fn data(&mut self, id: i64) -> Result<MessageData> {
        let path = self.database.path.clone();
        let fail = |error| wrong(&path, u64::try_from(id).unwrap_or(0), &error);
        let database = self.database.open().map_err(fail)?;
        let memory_bytes = self.spill.budget().bytes / 2;
        const QUERY: &str =
            "SELECT length(data), CASE WHEN length(data) <= ?2 THEN data END FROM messages WHERE id = ?1";
        let row = database.prepare_cached(QUERY).and_then(|mut statement| {
            let limits = [id, i64::try_from(memory_bytes).unwrap_or(i64::MAX)];
            statement.query_row(limits, |row| {
                let bytes: i64 = row.get(0)?;
                let data: Option<Vec<u8>> = row.get(1)?;
                Ok((bytes, data))
            })
        });
        let bytes = match row.map_err(fail)? {
            (_, Some(data)) => return Ok(MessageData::from(data)),
            (bytes, None) => u64::try_from(bytes).unwrap_or(0),
        };
        let input = database.blob_open(MAIN_DB, "messages", "data", id, true).map_err(fail)?;
        let (data, complaint) =
            self.spill.take(input, StreamSize::Claimed(bytes), memory_bytes, &mut |_| {})?;
        match complaint {
            Some(complaint) => {
                Err(FormatError::at_record(u64::try_from(id).unwrap_or(0), complaint.reason).in_input(&path))
            }
            None => Ok(MessageData(data)),
        }
    }
}

impl Database {
    fn open(&mut self) -> rusqlite::Result<&Connection> {
        let connection = match self.connection.take() {
            Some(connection) => connection,
            None => {
                let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
                let connection = Connection::open_with_flags(&self.path, flags)?;
                let max_bytes = i32::try_from(self.max_bytes).unwrap_or(i32::MAX);
                connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, max_bytes)?;
                connection
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
        self.places = None;
        let budget = self.spill.budget().clone();
        let mut places = Sorter::new(&budget, budget.bytes / 4);
        let mut found = 0;
        match self.find_rows(&TopicSet::of(topics), &mut places, &mut found) {
            Ok(kept) => kept?,
            Err(error) => {
                let path = self.database.path.display();
                let remark =
                    format!("{path} is damaged ({error}): {found} messages were found before the damage");
                if !self.remarks.contains(&remark) {
                    self.remarks.push(remark);
                }
            }
        }
        self.places = Some(places.finish()?);
        Ok(())
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        let next = self.places.as_mut().map(Sorted::next).transpose()?.flatten();
        let Some(RowPlace { log_ns, id, topic }) = next else { return Ok(None) };
        let data = self.data(id)?;
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
    FormatError::at_record(row, format!("it cannot be read as a ROS 2 bag: {error}")).in_input(path)
}
