//! The GPUs that Slurm gave this job: those, and no others, are used.
//!
//! Slurm keeps a job from other GPUs only where a cluster is set up so, and says in environment variables which are the job's.
//! Those name them as CUDA does or count device files; Vulkan knows them by their address on the PCI bus. NVIDIA's driver says
//! in /proc which is which.

use std::fs;
use std::path::Path;

use super::adapter::AdapterFacts;
use crate::{Error, Result};

/// Where NVIDIA's driver describes its GPUs, a folder each.
const NVIDIA: &str = "/proc/driver/nvidia/gpus";

/// What Slurm gave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Given {
    /// This process is not a job of Slurm's, and may use what there is.
    Everything,
    /// GPUs by their PCI addresses.
    Addresses(Vec<String>),
    /// GPUs by their places in the order of PCI addresses, where no driver says more. Perhaps none.
    Places(Vec<usize>),
    /// So many, without a word on which: the cluster counts its GPUs and does not know their device files.
    Count(usize),
}

/// A GPU in /proc.
#[derive(Debug, Clone, PartialEq)]
struct Described {
    uuid: String,
    /// The number in the name of its device file.
    minor: usize,
    address: String,
}

/// What this process was given.
pub(super) fn given() -> Result<Given> {
    let of_environment = |name: &str| std::env::var(name).ok();
    of(&of_environment, &described(Path::new(NVIDIA)))
}

fn described(folder: &Path) -> Vec<Described> {
    // Without the driver there is no such folder; a GPU that is described otherwise is not known by number or name.
    let folders = fs::read_dir(folder).into_iter().flatten().flatten();
    let read = folders.filter_map(|entry| {
        let text = fs::read_to_string(entry.path().join("information")).ok()?;
        let field = |name: &str| {
            let rest = text.lines().find_map(|line| line.strip_prefix(name)?.trim_start().strip_prefix(':'))?;
            Some(rest.trim().to_owned())
        };
        Some(Described {
            uuid: field("GPU UUID")?,
            minor: field("Device Minor")?.parse().ok()?,
            address: normal(&field("Bus Location")?)?,
        })
    });
    read.collect()
}

/// A PCI address as `domain:bus:device.function` in hex, four, two, two and one digits.
fn normal(address: &str) -> Option<String> {
    let (rest, function) = address.trim().rsplit_once('.')?;
    let numbers: Vec<u32> = rest.split(':').map(|n| u32::from_str_radix(n, 16).ok()).collect::<Option<_>>()?;
    let [domain, bus, device] = numbers.try_into().ok()?;
    Some(format!("{domain:04x}:{bus:02x}:{device:02x}.{}", function.to_ascii_lowercase()))
}

fn of(variable: &dyn Fn(&str) -> Option<String>, nvidia: &[Described]) -> Result<Given> {
    if variable("SLURM_JOB_ID").is_none() {
        return Ok(Given::Everything);
    }
    let list = |names: &[&str]| -> Vec<String> {
        let text = names.iter().find_map(|name| variable(name).filter(|text| !text.trim().is_empty()));
        let words = text.iter().flat_map(|text| text.split(',')).map(|word| word.trim().to_owned());
        // What old versions set where there is none.
        words.filter(|word| !word.is_empty() && word != "NoDevFiles").collect()
    };
    let refused = |word: &str| {
        Error::NoDevice(format!(
            "Slurm gave this job the GPU `{word}`, which cannot be told from the others here; ask for whole GPUs, or for all of \
             a node (--exclusive) and choose with --devices"
        ))
    };
    let visible = list(&["CUDA_VISIBLE_DEVICES", "ROCR_VISIBLE_DEVICES", "HIP_VISIBLE_DEVICES"]);
    if visible.iter().any(|word| word.parse::<usize>().is_err()) {
        // Names, which may be cut off as long as they are unambiguous.
        let address = |word: &String| {
            let mut alike = nvidia.iter().filter(|gpu| word.starts_with("GPU-") && gpu.uuid.starts_with(word.as_str()));
            match (alike.next(), alike.next()) {
                (Some(gpu), None) => Ok(gpu.address.clone()),
                _ => Err(refused(word)),
            }
        };
        return visible.iter().map(address).collect::<Result<_>>().map(Given::Addresses);
    }
    // Slurm's own numbers are those of device files. CUDA's begin at 0 in every job where device files are constrained, so
    // they count only where Slurm's are missing.
    let own = list(&["SLURM_STEP_GPUS", "SLURM_JOB_GPUS"]);
    let (numbers, are_files) = if own.is_empty() { (visible, false) } else { (own, true) };
    let numbers = expand(&numbers).map_err(|word| refused(&word))?;
    if numbers.is_empty() {
        let count = variable("SLURM_GPUS_ON_NODE").and_then(|text| text.trim().parse::<usize>().ok());
        return Ok(count.filter(|&n| n > 0).map_or(Given::Places(Vec::new()), Given::Count));
    }
    if nvidia.is_empty() {
        return Ok(Given::Places(numbers));
    }
    let mut in_order: Vec<&Described> = nvidia.iter().collect();
    in_order.sort_by(|a, b| a.address.cmp(&b.address));
    let address = |&number: &usize| {
        let gpu = if are_files { nvidia.iter().find(|gpu| gpu.minor == number) } else { in_order.get(number).copied() };
        gpu.map(|gpu| gpu.address.clone()).ok_or_else(|| refused(&number.to_string()))
    };
    numbers.iter().map(address).collect::<Result<_>>().map(Given::Addresses)
}

/// Numbers and ranges such as `2-4`.
fn expand(words: &[String]) -> std::result::Result<Vec<usize>, String> {
    let mut numbers = Vec::new();
    for word in words {
        let (from, to) = word.split_once('-').unwrap_or((word, word));
        match (from.parse::<usize>(), to.parse::<usize>()) {
            (Ok(from), Ok(to)) if from <= to && to < 1024 => numbers.extend(from..=to),
            _ => return Err(word.clone()),
        }
    }
    Ok(numbers)
}

impl Given {
    /// Of the usable GPUs `gpus`, positions in `listed`, those that were given. An error where one of these is not there.
    pub fn among(&self, listed: &[AdapterFacts], gpus: &[usize]) -> Result<Vec<usize>> {
        let missing = |which: &str| {
            Error::NoDevice(format!(
                "Slurm gave this job {which}, but Vulkan shows no such GPU here: install its Vulkan driver on this node, or \
                 render on CPUs (submit with --gpus-per-task 0 or --allow-software)"
            ))
        };
        match self {
            Given::Everything => Ok(gpus.to_vec()),
            Given::Places(places) if places.is_empty() => Ok(Vec::new()),
            Given::Count(count) if gpus.is_empty() => Err(missing(&format!("{count} GPUs"))),
            Given::Count(count) if gpus.len() > *count => Err(Error::NoDevice(format!(
                "Slurm gave this job {count} of {} GPUs here, but does not say which (gres.conf names no device files); ask for \
                 all of a node, or choose with --devices",
                gpus.len()
            ))),
            Given::Count(_) => Ok(gpus.to_vec()),
            // Where other GPUs are hidden from the job, those that it sees are its own.
            Given::Places(places) if gpus.len() == places.len() => Ok(gpus.to_vec()),
            Given::Addresses(addresses)
                if gpus.len() == addresses.len() && gpus.iter().any(|&i| listed[i].pci.is_none()) =>
            {
                Ok(gpus.to_vec())
            }
            Given::Addresses(addresses) => {
                let found = |address: &String| {
                    let found = gpus.iter().copied().find(|&i| listed[i].pci.as_ref() == Some(address));
                    found.ok_or_else(|| missing(&format!("the GPU at {address}")))
                };
                addresses.iter().map(found).collect()
            }
            Given::Places(places) => {
                let mut in_order = gpus.to_vec();
                in_order.sort_by_key(|&i| listed[i].pci.clone());
                let found = |&place: &usize| {
                    in_order.get(place).copied().ok_or_else(|| missing(&format!("its GPU number {place}")))
                };
                places.iter().map(found).collect()
            }
        }
    }

    /// GPUs given.
    pub fn count(&self) -> usize {
        match self {
            Given::Everything => 0,
            Given::Addresses(addresses) => addresses.len(),
            Given::Places(places) => places.len(),
            Given::Count(count) => *count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four GPUs, whose device files are not in the order of their addresses.
    fn nvidia() -> Vec<Described> {
        let folder = tempfile::tempdir().expect("folder");
        for (minor, bus) in [(0, "c1"), (1, "07"), (2, "81"), (3, "41")] {
            let gpu = folder.path().join(format!("0000:{bus}:00.0"));
            fs::create_dir(&gpu).expect("made");
            let text = format!(
                "Model: \t\t NVIDIA H100\nIRQ:   \t\t 95\nGPU UUID: \t GPU-{bus}aaaa-0000\nBus Location: \t 00000000:{bus}:00.0\nDevice \
                 Minor: \t {minor}\nGPU Excluded:\t No\n"
            );
            fs::write(gpu.join("information"), text).expect("written");
        }
        described(folder.path())
    }

    fn given(variables: &[(&str, &str)], nvidia: &[Described]) -> Result<Given> {
        let variable = |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, value)| value.to_string());
        of(&variable, nvidia)
    }

    fn addresses(list: &[&str]) -> Given {
        Given::Addresses(list.iter().map(|bus| format!("0000:{bus}:00.0")).collect())
    }

    #[test]
    fn what_slurm_says_names_gpus_on_the_bus() {
        let gpus = nvidia();
        assert_eq!(gpus.len(), 4);
        let job = ("SLURM_JOB_ID", "12");
        for (variables, expected) in [
            (&[("CUDA_VISIBLE_DEVICES", "1")][..], Given::Everything),
            (&[job], Given::Places(vec![])),
            (&[job, ("CUDA_VISIBLE_DEVICES", "NoDevFiles")], Given::Places(vec![])),
            (&[job, ("SLURM_GPUS_ON_NODE", "0")], Given::Places(vec![])),
            (&[job, ("SLURM_GPUS_ON_NODE", "2")], Given::Count(2)),
            // Slurm counts device files, CUDA goes by addresses; in a constrained job it begins at 0 again.
            (&[job, ("SLURM_JOB_GPUS", "0,3"), ("CUDA_VISIBLE_DEVICES", "0,1")], addresses(&["c1", "41"])),
            (&[job, ("SLURM_JOB_GPUS", "0-2"), ("SLURM_STEP_GPUS", "2")], addresses(&["81"])),
            (&[job, ("CUDA_VISIBLE_DEVICES", "0,3")], addresses(&["07", "c1"])),
            (&[job, ("CUDA_VISIBLE_DEVICES", "GPU-81aaaa-0000,GPU-07")], addresses(&["81", "07"])),
        ] {
            assert_eq!(given(variables, &gpus).expect("told"), expected, "{variables:?}");
        }
        for (name, value) in
            [("CUDA_VISIBLE_DEVICES", "MIG-1234"), ("CUDA_VISIBLE_DEVICES", "GPU-"), ("SLURM_JOB_GPUS", "7")]
        {
            let error = given(&[job, (name, value)], &gpus).expect_err(value);
            assert!(error.exit_code() == 3 && error.to_string().contains(&format!("`{value}`")), "{error}");
        }
        assert_eq!(given(&[job, ("SLURM_JOB_GPUS", "0-1,3")], &[]).expect("told"), Given::Places(vec![0, 1, 3]));
    }

    #[test]
    fn those_and_no_others() {
        let listed: Vec<AdapterFacts> = ["c1", "07", "81"]
            .iter()
            .map(|bus| AdapterFacts { pci: Some(format!("0000:{bus}:00.0")), ..AdapterFacts::default() })
            .collect();
        let among = |given: &Given| given.among(&listed, &[0, 1, 2]);
        assert_eq!(among(&Given::Everything).expect("all"), [0, 1, 2]);
        assert_eq!(among(&Given::Places(vec![])).expect("none"), [0usize; 0]);
        assert_eq!(among(&addresses(&["81", "07"])).expect("two"), [2, 1]);
        assert_eq!(among(&Given::Places(vec![0, 2])).expect("two"), [1, 0]);
        assert_eq!(among(&Given::Count(3)).expect("all"), [0, 1, 2]);
        assert!(among(&Given::Count(2)).expect_err("which?").to_string().contains("2 of 3 GPUs here"));
        assert!(Given::Count(2).among(&listed, &[]).expect_err("none").to_string().contains("no such GPU here"));
        // What one sees is what one was given, whatever it is called outside.
        let nameless = vec![AdapterFacts::default(); 2];
        assert_eq!(addresses(&["01", "02"]).among(&nameless, &[0, 1]).expect("both"), [0, 1]);
        assert_eq!(Given::Places(vec![2, 3]).among(&nameless, &[0, 1]).expect("both"), [0, 1]);
        for given in [addresses(&["55"]), addresses(&["01", "02", "03"]), Given::Places(vec![5])] {
            let error = among(&given).expect_err("not there");
            assert!(error.to_string().contains("Slurm gave this job"), "{error}");
        }
    }

    #[test]
    fn addresses_have_one_form() {
        assert_eq!(normal("00000000:0A:1f.0").as_deref(), Some("0000:0a:1f.0"));
        assert_eq!(normal("0001:81:00.1").as_deref(), Some("0001:81:00.1"));
        assert_eq!(normal("81:00"), None);
    }
}
