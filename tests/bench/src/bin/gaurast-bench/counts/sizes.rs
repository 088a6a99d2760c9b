//! Bytes of the device's functions in this program, summed by module and SIMD level.
//!
//! The symbol table gives a function's address, size and module. The debug information gives its type parameters: the
//! SIMD level, and the closure for which a function of `fearless_simd` is instantiated.

use std::collections::{BTreeMap, HashMap, HashSet};

use gimli::{AttributeValue, DebuggingInformationEntry, EndianSlice, LittleEndian, Unit};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

use super::error::CountsError;
use super::report::Report;
use super::stored::{Table, percent};
use crate::output::Rows;

/// The percentage by which a sum may differ from the stored one.
const TOLERANCE: f64 = 5.0;

/// The least number of bytes of a sum that is stored.
const LEAST: u64 = 4096;

/// The crates whose functions are counted.
const CRATES: [&str; 2] = ["simdevice", "isa"];

/// The type names of the levels, and the levels' names.
const LEVELS: [(&str, &str); 3] = [("::Sse2", "sse2"), ("::Avx2", "avx2"), ("::Avx512", "avx512")];

/// The size of a module's functions at a level.
#[derive(Clone, Copy, Default)]
struct Sum {
    functions: u64,
    bytes: u64,
}

/// Compares the bytes of every module at every level with the stored ones, or stores them.
pub(super) fn check(report: &mut Report, store: bool) -> Result<(), CountsError> {
    let mut table = Table::load(
        "sizes.csv",
        "Functions of a module at a SIMD level and their bytes in the program, profiling profile. Written by gaurast-bench counts --store.",
        &["module", "level", "functions", "bytes"],
        2,
    )?;
    let sums = sums(&std::fs::read(std::env::current_exe()?)?)?;
    if store {
        table.clear();
        for ((module, level), sum) in sums.iter().filter(|(_, sum)| sum.bytes >= LEAST) {
            let [functions, bytes] = [sum.functions, sum.bytes].map(|number| number.to_string());
            table.set(&[module, level], &[&functions, &bytes]);
        }
        return table.store();
    }
    let mut rows = Rows::new(&["module", "level", "functions", "bytes", "stored", "change"]);
    let mut names: HashSet<(String, String)> = HashSet::new();
    for name in table.names() {
        names.insert((name[0].clone(), name[1].clone()));
    }
    let margin = (LEAST as f64 * (1.0 + TOLERANCE / 100.0)) as u64;
    let large = sums.iter().filter(|(_, sum)| sum.bytes > margin);
    names.extend(large.map(|(name, _)| name.clone()));
    let mut names: Vec<_> = names.into_iter().collect();
    names.sort();
    let count = names.len();
    for name in names {
        let sum = sums.get(&name).copied().unwrap_or_default();
        let (module, level) = &name;
        let stored: Option<u64> = (table.get(&[module, level])).and_then(|cells| cells[1].parse().ok());
        let change = stored.map(|stored| percent(sum.bytes, stored));
        if change.is_some_and(|change| change.abs() <= TOLERANCE) {
            continue;
        }
        rows.rows.push(vec![
            module.clone(),
            level.clone(),
            sum.functions.to_string(),
            sum.bytes.to_string(),
            stored.map_or("-".to_owned(), |stored| stored.to_string()),
            change.map_or("new".to_owned(), |change| format!("{change:+.1} %")),
        ]);
    }
    println!("sizes: {} of {count} are the stored ones", count - rows.rows.len());
    if !rows.rows.is_empty() {
        println!("{}", rows.table());
        report.fail(format!(
            "{} modules are not as large as stored: find out why, or store the new sizes",
            rows.rows.len()
        ));
    }
    Ok(())
}

/// The sums of an ELF program, by module and level.
fn sums(program: &[u8]) -> Result<BTreeMap<(String, String), Sum>, CountsError> {
    let file = object::File::parse(program)?;
    let names = debug_names(&file)?;
    let mut sums: BTreeMap<_, Sum> = BTreeMap::new();
    let mut seen = HashSet::new();
    for symbol in file.symbols() {
        // Identical functions may be merged: several names have one address.
        if symbol.kind() != SymbolKind::Text || symbol.size() == 0 || !seen.insert(symbol.address()) {
            continue;
        }
        let path = format!("{:#}", rustc_demangle::demangle(symbol.name()?));
        let debug_name = names.get(&symbol.address()).map_or("", String::as_str);
        if let Some(module) = module(&path, debug_name) {
            let level = level(&path).or_else(|| level(debug_name)).unwrap_or("-");
            let sum = sums.entry((module, level.to_owned())).or_default();
            sum.functions += 1;
            sum.bytes += symbol.size();
        }
    }
    if sums.is_empty() {
        return Err(CountsError::Stripped);
    }
    Ok(sums)
}

/// The module or type to which a function belongs, if it is part of one of [`CRATES`]. `debug_name` is
/// `name<parameters>`.
fn module(path: &str, debug_name: &str) -> Option<String> {
    let path = if path.starts_with("<fearless_simd::") { debug_name.split_once('<')?.1 } else { path };
    let path = path.trim_start_matches(['<', '&']);
    let end = path.find([' ', '<', '{']).unwrap_or(path.len());
    let parts: Vec<&str> = path[..end].split("::").filter(|part| !part.is_empty()).collect();
    if !CRATES.contains(parts.first()?) {
        return None;
    }
    // The last part is the function's name, or a type's name if the function is associated with it. For a function
    // in an implementation or a closure, it is the name of the module or of the surrounding function.
    let is_within = path[..end].ends_with("::");
    let length = parts.len() - usize::from(!is_within);
    Some(parts[..length.clamp(1, 4)].join("::"))
}

/// The level whose type occurs in a name.
fn level(name: &str) -> Option<&'static str> {
    let is_in = |kind: &str| {
        let rest = |at: usize| name[at + kind.len()..].chars().next();
        let ends = |at| !rest(at).is_some_and(|c| c.is_alphanumeric() || c == '_');
        name.match_indices(kind).any(|(at, _)| ends(at))
    };
    let found = LEVELS.iter().find(|(kind, _)| is_in(kind));
    found.map(|(_, level)| *level)
}

type Reader<'a> = EndianSlice<'a, LittleEndian>;

/// The names of functions with their type parameters, by address.
fn debug_names(file: &object::File<'_>) -> Result<HashMap<u64, String>, CountsError> {
    let dwarf = gimli::Dwarf::load(|id| {
        let section = file.section_by_name(id.name());
        let data = section.map_or(Ok(&[][..]), |section| section.data())?;
        Ok::<_, CountsError>(EndianSlice::new(data, LittleEndian))
    })?;
    let mut names = HashMap::new();
    let mut headers = dwarf.units();
    while let Some(header) = headers.next()? {
        let unit = dwarf.unit(header)?;
        let mut entries = unit.entries();
        while let Some((_, entry)) = entries.next_dfs()? {
            if entry.tag() != gimli::DW_TAG_subprogram {
                continue;
            }
            let Some(start) = entry.attr_value(gimli::DW_AT_low_pc)? else {
                continue;
            };
            let address = dwarf.attr_address(&unit, start)?;
            if let (Some(address), Some(name)) = (address, name(&dwarf, &unit, entry)?) {
                names.insert(address, name);
            }
        }
    }
    Ok(names)
}

/// A function's name: its own, or that of the abstract function that it instantiates.
fn name(
    dwarf: &gimli::Dwarf<Reader<'_>>,
    unit: &Unit<Reader<'_>>,
    entry: &DebuggingInformationEntry<'_, '_, Reader<'_>>,
) -> Result<Option<String>, gimli::Error> {
    if let Some(name) = entry.attr_value(gimli::DW_AT_name)? {
        let name = dwarf.attr_string(unit, name)?;
        return Ok(Some(name.to_string_lossy().into_owned()));
    }
    let Some(AttributeValue::UnitRef(origin)) = entry.attr_value(gimli::DW_AT_abstract_origin)? else {
        return Ok(None);
    };
    let origin = unit.entry(origin)?;
    let Some(name) = origin.attr_value(gimli::DW_AT_name)? else {
        return Ok(None);
    };
    let name = dwarf.attr_string(unit, name)?;
    Ok(Some(name.to_string_lossy().into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_belong_to_modules() {
        let of = |path: &str| module(path, "");
        let owned = |text: &str| Some(text.to_owned());
        assert_eq!(of("isa::optimize::optimize"), owned("isa::optimize"));
        assert_eq!(of("simdevice::gaussian::GaussianSet::sort"), owned("simdevice::gaussian::GaussianSet"));
        assert_eq!(
            of("simdevice::raster::gaussian::by_block::<impl simdevice::raster::gaussian::Task>::falls"),
            owned("simdevice::raster::gaussian::by_block")
        );
        assert_eq!(
            of("<isa::machine::engine::Kernels<S> as isa::machine::engine::Engine>::run"),
            owned("isa::machine::engine")
        );
        assert_eq!(of("core::ptr::drop_in_place<isa::ir::Type>"), None);
        assert_eq!(
            module(
                "<fearless_simd::generated::avx2::Avx2 as fearless_simd::generated::simd_trait::Simd>::vectorize::vectorize_avx2",
                "vectorize_avx2<simdevice::gaussian::{impl#1}::job::{closure_env#4}, ()>",
            ),
            owned("simdevice::gaussian")
        );
    }

    #[test]
    fn levels_are_known_by_their_types() {
        assert_eq!(level("run<fearless_simd::generated::avx2::Avx2, 4>"), Some("avx2"));
        assert_eq!(level("<fearless_simd::generated::avx512::Avx512 as X>"), Some("avx512"));
        assert_eq!(level("run<fearless_simd::generated::sse2::Sse2>"), Some("sse2"));
        assert_eq!(level("run<Other>"), None);
    }
}
