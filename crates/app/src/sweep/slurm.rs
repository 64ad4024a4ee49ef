//! A sweep as an array of Slurm tasks.

/// What the script asks of Slurm.
#[derive(Clone, Debug, PartialEq)]
pub struct SlurmScript {
    /// The command and its arguments, without `--shard`: `["anisobond", "sweep", "table.toml", "-o", "out"]`.
    pub command: Vec<String>,
    /// The command that merges the shards, with its arguments.
    pub merge: Vec<String>,
    /// Number of tasks n; task i computes shard i/n, i from 0 to n − 1.
    pub shards: usize,
    /// Name of the job.
    pub name: String,
    /// Processors of each task.
    pub cpus: usize,
    /// Longest time of a task, as Slurm writes it: "1-00:00:00".
    pub time: String,
}

/// A script for `sbatch`: one task per shard, and how to merge them. Submitted again after a stop, it goes on with what
/// is missing.
pub fn slurm_script(script: &SlurmScript) -> String {
    let SlurmScript { shards, cpus, .. } = script;
    let last = shards.saturating_sub(1);
    let (name, time) = (directive(&script.name), directive(&script.time));
    let (command, merge) = (shell(&script.command), shell(&script.merge));
    format!(
        "#!/bin/bash\n\
         #SBATCH --job-name={name}\n\
         #SBATCH --array=0-{last}\n\
         #SBATCH --ntasks=1\n\
         #SBATCH --cpus-per-task={cpus}\n\
         #SBATCH --time={time}\n\
         #SBATCH --output={name}.%A_%a.out\n\
         #\n\
         # Task i of {shards} computes shard i/{shards}, i from 0 to {last}: every job of the table whose index, from 0,\n\
         # leaves the remainder i when divided by {shards}. Submit:  sbatch THIS_FILE\n\
         # What is finished is kept: submitted again, a task goes on where it was stopped.\n\
         # When all tasks are done, merge once:\n\
         #   {merge}\n\
         # or at once, to wait for them:\n\
         #   sbatch --dependency=afterany:JOB_ID --wrap={}\n\
         set -euo pipefail\n\
         export RAYON_NUM_THREADS=\"${{SLURM_CPUS_PER_TASK:-{cpus}}}\"\n\
         exec {command} --shard \"${{SLURM_ARRAY_TASK_ID}}/{shards}\"\n",
        quote(&merge)
    )
}

/// A value of a directive: its first line, without spaces.
fn directive(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.:+=".contains(c) { c } else { '_' };
    text.trim().chars().map(plain).collect()
}

fn shell(words: &[String]) -> String {
    words.iter().map(|word| quote(word)).collect::<Vec<_>>().join(" ")
}

/// A word as the shell reads it back, on one line.
fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:+,@%".contains(c);
    let word = word.replace(['\n', '\r'], " ");
    if !word.is_empty() && word.chars().all(plain) { word } else { format!("'{}'", word.replace('\'', "'\\''")) }
}
