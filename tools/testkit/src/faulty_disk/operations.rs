use super::disk::FaultyDisk;
use super::handles::{Locked, Reader, ScratchFile, Watch, Writer};
use super::names::{Entry, NameChange};
use super::operation::Kind;
use super::state::BeforeLock;
use std::io::{self, Read};
use std::path::Path;
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch, Scratch};

impl FaultyDisk {
    fn reader(&self, path: &Path) -> io::Result<Reader> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        let inode = state.file(path)?;
        let bytes = state.content(inode).seen.clone();
        Ok(Reader { disk: self.clone(), path: path.to_owned(), bytes, at: 0, shared: None })
    }
}

impl Disk for FaultyDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        *self.state().opened.entry(path.to_owned()).or_default() += 1;
        Ok(Box::new(self.reader(path)?))
    }

    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        let has_bad_bytes = self.state().unreadable.contains_key(path);
        let mut input = self.reader(path)?;
        if has_bad_bytes {
            // Skips the bytes before `offset`, which may be bad.
            input.at = input.bytes.len().min(offset as usize);
        } else {
            io::copy(&mut input.by_ref().take(offset), &mut io::sink())?;
        }
        Ok(Box::new(input))
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        let inode = state.file(path)?;
        state.content(inode).readers += 1;
        let bytes = state.content(inode).seen.clone();
        Ok(Box::new(Reader { disk: self.clone(), path: path.to_owned(), bytes, at: 0, shared: Some(inode) }))
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        let inode = state.file(path)?;
        Ok(Box::new(Watch { disk: self.clone(), inode }))
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        let mut state = self.state();
        state.attempt(Kind::NeedsSpace, path)?;
        let inode = state.file_or_new(path)?;
        let is_linked = state.names.values().filter(|entry| **entry == Entry::File(inode)).count() > 1;
        if is_linked {
            state.change_name(NameChange::Remove(path.to_owned()));
        }
        let inode = state.file_or_new(path)?;
        state.unreadable.remove(path);
        let content = state.content(inode);
        content.seen.clear();
        content.lost = false;
        Ok(Box::new(Writer { disk: self.clone(), path: path.to_owned(), inode }))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        let inode = state.file(path)?;
        let content = state.content(inode);
        if (content.seen.len() as u64) < offset {
            return Err(io::Error::other("shorter than expected"));
        }
        if content.seen.len() as u64 != offset {
            content.seen.truncate(offset as usize);
            content.lost = false;
        }
        Ok(Box::new(Writer { disk: self.clone(), path: path.to_owned(), inode }))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        let inode = state.file(path)?;
        state.sync(inode, path)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        let is_in = |name: &Path| name.parent() == Some(path);
        let changes = std::mem::take(&mut state.unsynced_names);
        let is_synced = |change: &NameChange| match change {
            NameChange::Put(name, _) | NameChange::Remove(name) | NameChange::RemoveFolder(name, _) => {
                is_in(name)
            }
            NameChange::RenameFile(from, to, _) | NameChange::RenameFolder(from, to) => {
                is_in(from) || is_in(to)
            }
        };
        let (mut synced, mut unsynced) = (Vec::new(), Vec::new());
        for change in changes {
            if !is_synced(&change) {
                unsynced.push(change);
                continue;
            }
            if let NameChange::RemoveFolder(folder, gone) = &change {
                unsynced = unsynced.into_iter().filter_map(|change| change.without(folder, gone)).collect();
            }
            synced.push(change);
        }
        state.unsynced_names = unsynced;
        synced.iter().for_each(|change| change.apply(&mut state.names_on_medium));
        Ok(())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.state();
        let path = if state.broken.contains(to) { to } else { from };
        state.attempt(Kind::Changes, path)?;
        state.attempt_rename(to)?;
        let Some(entry) = state.names.get(from).copied() else { return Err(io::ErrorKind::NotFound.into()) };
        match (entry, state.names.get(to)) {
            (_, None) | (Entry::File(_), Some(Entry::File(_))) => {}
            _ => return Err(io::ErrorKind::AlreadyExists.into()),
        }
        state.unreadable.remove(to);
        if let Some(bytes) = state.unreadable.remove(from) {
            state.unreadable.insert(to.to_owned(), bytes);
        }
        let (from, to) = (from.to_owned(), to.to_owned());
        let change = match entry {
            Entry::File(inode) => NameChange::RenameFile(from, to, inode),
            Entry::Folder => {
                // Unsynced changes in a folder follow its rename.
                state.unsynced_names.iter_mut().for_each(|change| change.follow(&from, &to));
                NameChange::RenameFolder(from, to)
            }
        };
        state.change_name(change);
        Ok(())
    }

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        self.state().attempt(Kind::NeedsSpace, folder)?;
        Ok(Box::new(ScratchFile { disk: self.clone(), folder: folder.to_owned(), content: Vec::new() }))
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::NeedsSpace, from)?;
        let inode = state.file(from)?;
        match state.names.contains_key(to) {
            _ if !state.has_links => return Err(io::ErrorKind::Unsupported.into()),
            true => return Err(io::ErrorKind::AlreadyExists.into()),
            false => state.change_name(NameChange::Put(to.to_owned(), Entry::File(inode))),
        }
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        state.file(path)?;
        state.unreadable.remove(path);
        state.change_name(NameChange::Remove(path.to_owned()));
        Ok(())
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::NeedsSpace, path)?;
        if state.names.contains_key(path) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        state.change_name(NameChange::Put(path.to_owned(), Entry::Folder));
        Ok(())
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        let mut state = self.state();
        state.attempt(Kind::Changes, path)?;
        if state.names.keys().any(|name| name.parent() == Some(path)) {
            return Err(io::ErrorKind::DirectoryNotEmpty.into());
        }
        let on_medium = state.names_on_medium.iter();
        let in_flight = state.unsynced_names.iter().filter_map(|change| match change {
            NameChange::Put(name, entry) => Some((name, *entry)),
            NameChange::RenameFile(_, name, inode) => Some((name, Entry::File(*inode))),
            _ => None,
        });
        let on_medium = on_medium.map(|(name, entry)| (name, *entry));
        let in_it = on_medium.chain(in_flight).filter(|(name, _)| name.starts_with(path));
        let files = in_it.filter_map(|(_, entry)| match entry {
            Entry::File(inode) => Some(inode),
            Entry::Folder => None,
        });
        let change = NameChange::RemoveFolder(path.to_owned(), files.collect());
        state.change_name(change);
        Ok(())
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        if state.names.get(path) != Some(&Entry::Folder) {
            return Err(io::ErrorKind::NotFound.into());
        }
        let names = state.names.keys().filter(|name| name.parent() == Some(path));
        Ok(names.map(|name| name.file_name().unwrap().to_str().unwrap().to_owned()).collect())
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        let mut state = self.state();
        state.attempt(Kind::Reads, path)?;
        Ok(state.names.get(path).map(|entry| match entry {
            Entry::Folder => EntryKind::Folder,
            Entry::File(inode) => EntryKind::File(state.contents[inode].seen.len() as u64),
        }))
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        let before_lock = self.state().before_lock.take();
        if let Some(BeforeLock(happens)) = before_lock {
            happens();
        }
        let mut state = self.state();
        let is_there = state.names.contains_key(path);
        state.attempt(if is_there { Kind::Changes } else { Kind::NeedsSpace }, path)?;
        let inode = state.file_or_new(path)?;
        let content = state.content(inode);
        if std::mem::replace(&mut content.locked, true) {
            return Ok(None);
        }
        Ok(Some(Box::new(Locked { disk: self.clone(), inode, path: path.to_owned() })))
    }

    fn pause(&self) {
        std::thread::yield_now();
    }
}
