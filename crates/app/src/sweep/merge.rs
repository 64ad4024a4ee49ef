//! The stores of all shards as one.

use std::path::Path;

use super::store::{Shard, Store, Sweep};
use anisobond::{Error, Result};
use anisobond_formats::words::enumeration;

/// Merges the stores of all shards of a sweep into one, which is made or added to; the shards stay as they are. Jobs
/// that are not finished stay so, and can be computed in the merged store.
///
/// # Errors
/// Stores of different sweeps, tables or numbers of shards; a shard that is missing or given twice; a file that cannot
/// be read or written. Nothing is changed then.
pub fn merge(merged: impl AsRef<Path>, shards: &[impl AsRef<Path>]) -> Result<Store> {
    let shards: Vec<Store> = shards.iter().map(Store::read).collect::<Result<_>>()?;
    let sweep = common(&shards)?;
    let records: Vec<_> = shards.iter().map(Store::records).collect::<Result<_>>()?;
    let mut store = Store::create(merged.as_ref(), &sweep, "the shards' store")?;
    store.put(records.into_iter().flatten())?;
    Ok(store)
}

/// The sweep that all shards are of, as a whole.
fn common(shards: &[Store]) -> Result<Sweep> {
    let mut sweeps = Vec::new();
    for store in shards {
        sweeps.push((store, store.sweep()?));
    }
    let Some((first, head)) = sweeps.first() else {
        return Err(Error::input("there is no shard to merge", "give the stores of all shards"));
    };
    let count = match head.shard {
        Some(shard) => shard.count,
        None => return Err(whole(first)),
    };
    let mut missing: Vec<usize> = (0..count).collect();
    for (store, sweep) in &sweeps {
        let Some(shard) = sweep.shard else { return Err(whole(store)) };
        Sweep { shard: Some(shard), ..head.clone() }
            .refuse_other(sweep, &first.path().display().to_string())
            .map_err(|e| e.at(store.path().display()))?;
        refuse_other_table((first, head), (store, sweep), count)?;
        let before = missing.len();
        missing.retain(|index| *index != shard.index);
        if missing.len() == before {
            let problem = format!("shard {shard} is given twice");
            return Err(Error::input(problem, "give each shard once").at(store.path().display()));
        }
    }
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|&index| Shard { index, count }.to_string()).collect();
        let word = if names.len() == 1 { "shard" } else { "shards" };
        return Err(Error::input(format!("{word} {} missing", enumeration(&names)), "give the stores of all shards"));
    }
    Ok(Sweep { shard: None, ..head.clone() })
}

fn whole(store: &Store) -> Error {
    Error::input("this store is of a whole sweep, not of a shard", "give the stores of shards")
        .at(store.path().display())
}

fn refuse_other_table(first: (&Store, &Sweep), other: (&Store, &Sweep), count: usize) -> Result<()> {
    if first.1.table != other.1.table || other.1.shard.map(|s| s.count) != Some(count) {
        let problem = format!("this shard is of another table or division than {}", first.0.path().display());
        return Err(
            Error::input(problem, "run all shards with the same table and the same n").at(other.0.path().display())
        );
    }
    Ok(())
}
