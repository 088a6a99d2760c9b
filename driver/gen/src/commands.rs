//! Writes `dispatch/commands.rs`: the functions that Vulkan calls, around the driver's own, and the table of them.
//!
//! A function of the driver takes parameters of its command, by their names without `p_`, or members of the structure
//! that a parameter points at. It takes those that it declares, each in the form that it declares: the command's own
//! type; a handle as the object (`&Buffer`, `&Arc<Buffer>`, `Option<&Buffer>`, or, to be destroyed,
//! `Option<Arc<Buffer>>`); a pointer as its target (`&T`, `&mut T`, `Option<&T>`, `&[T]`, `&[Arc<Buffer>]`,
//! `Handles<'_, vk::Buffer>` or an option of it, `&CStr`, `&mut [MaybeUninit<T>]`, `OutputChain<'_, T>`, and with its count
//! `Structures<'_, T>`); a `VkBool32` as a `bool`; a command buffer as its `recorder`; a structure of the chain as
//! `Option<&T>`; and `&Commands`, the table. An output pointer that it doesn't take receives the value that it returns:
//! a value, an `Arc` of an object, or a list. If a command has a second version, which takes a structure of the first
//! one's parameters, a function for the second is enough. A command that only sets a dynamic state whose value is its
//! parameter needs no function.

use crate::ash::{self, Declarations, Function, Member};
use crate::dynamic_states;
use crate::entry_points::EntryPoint;
use crate::error::Error;
use crate::registry::{self, Registry};
use crate::rust;
use crate::support::Support;
use crate::tables;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// A name under which a command is found.
struct Row<'a> {
    name: &'a str,
    gate: String,
}

/// The generated parts of the file.
#[derive(Default)]
struct Output {
    functions: String,
    /// The names of the functions.
    defined: BTreeSet<String>,
    /// Pairs of scope and availability, each with its rows of the table.
    blocks: Vec<(String, Vec<String>)>,
}

impl Output {
    /// The text of the table, formatted here because rustfmt does not format the arguments of macros.
    fn table(&self) -> String {
        let mut text = "static ROWS: &[Command] = rows! {\n".to_owned();
        for (block, lines) in &self.blocks {
            let _ = writeln!(text, "    {block} => {{");
            lines.iter().for_each(|line| text.push_str(line));
            text.push_str("    }\n");
        }
        text + "};\n\n/// Every command of the driver.\npub(super) static COMMANDS: Commands = Commands::new(ROWS);\n"
    }
}

/// The body of a command's function.
enum Body {
    /// An expression of `recorder`, the recorder of the command buffer.
    Recording(String),
    /// Statements that are safe with valid usage.
    Unsafe(String),
    /// An expression that is always safe.
    Safe(String),
    /// The command is refused.
    Refusal,
}

struct Writer<'a> {
    registry: &'a Registry,
    declarations: &'a Declarations,
    support: &'a Support,
    entry_points: &'a BTreeMap<String, EntryPoint>,
    dynamic_states: &'a BTreeMap<String, dynamic_states::Row>,
}

pub(crate) fn write(
    registry: &Registry,
    declarations: &Declarations,
    support: &Support,
    entry_points: &BTreeMap<String, EntryPoint>,
    dynamic_states: &BTreeMap<String, dynamic_states::Row>,
) -> Result<String, Error> {
    let writer = Writer { registry, declarations, support, entry_points, dynamic_states };
    let rows = rows(registry, support)?;
    for command in entry_points.keys() {
        if !rows.iter().any(|row| row.name == command) {
            return Err(Error::EntryPoint(format!(
                "{command} is no command of the core version or of a listed extension"
            )));
        }
    }
    let mut output = Output::default();
    for row in &rows {
        writer.add(&mut output, row)?;
    }
    let modules: BTreeSet<&str> = entry_points.values().filter_map(|it| it.path.split("::").next()).collect();
    let modules = modules.into_iter().filter(|module| *module != "super");
    let modules: Vec<&str> = modules.collect();
    rust::file(
        "//! The commands: the functions that Vulkan calls, and the table of them. Each function is safe to call within
//! Vulkan's valid usage: handles are live, or null where that is allowed, and pointers are null or valid.",
        &format!(
            "#![allow(non_snake_case, reason = \"Vulkan's names\")]
            #![allow(clippy::too_many_arguments, reason = \"Vulkan's signatures\")]
            #![allow(clippy::semicolon_if_nothing_returned, reason = \"functions return what their guards do\")]
            #![allow(clippy::redundant_closure, reason = \"all commands are recorded in closures\")]

            use super::lookup::Availability::{{Core, DeviceExtension, InstanceExtension}};
            use super::lookup::{{Command, Commands, Scope, rows}};
            use crate::abi::error::Error;
            use crate::abi::guard::{{guard, refuse}};
            use crate::abi::handle;
            use crate::abi::valid::{{self, OutputChain, Structures}};
            use crate::command::buffer::record;
            use crate::command::dynamic_state::{{set, set_faces}};
            use crate::pipeline::dynamic_state::DynamicState;
            use crate::registry::newer::API_VERSION_1_4;
            use crate::{{{modules}}};
            use ash::vk;

{table}
            {functions}",
            modules = modules.join(", "),
            table = output.table(),
            functions = output.functions
        ),
    )
}

/// All names of commands: those of the core version, and those of listed extensions.
fn rows<'a>(registry: &'a Registry, support: &'a Support) -> Result<Vec<Row<'a>>, Error> {
    let newest = support.version()?;
    let mut rows: Vec<Row<'a>> = Vec::new();
    let mut seen = BTreeSet::new();
    for requirement in registry.versions.iter().filter(|r| r.by <= newest) {
        let (major, minor) = requirement.by;
        for name in &requirement.commands {
            if seen.insert(name) {
                let path = if requirement.by > ash::VERSION { "" } else { "vk::" };
                rows.push(Row { name, gate: format!("Core({path}API_VERSION_{major}_{minor})") });
            }
        }
    }
    // A command may come with several extensions; one of them is enough.
    let mut extensions: Vec<(&'a str, &str, Vec<String>)> = Vec::new();
    for extension in support.extension.keys().filter_map(|name| registry.extension(name)) {
        let kind = if extension.is_of_instance { "InstanceExtension" } else { "DeviceExtension" };
        let names = extension
            .requirements
            .iter()
            .flat_map(|requirement| {
                let is_met = support.meets(requirement.depends.as_deref());
                let commands = requirement.commands.iter();
                // Earlier registries had them without a condition, so that programs ask for their functions.
                commands.filter(move |name| is_met || support.commands.refused.contains_key(*name))
            })
            .filter(|name| !seen.contains(name));
        for name in names {
            let by = format!("c\"{}\"", extension.name);
            match extensions.iter_mut().find(|(known, ..)| known == name) {
                Some((.., known)) if known.contains(&by) => {}
                Some((.., known)) => known.push(by),
                None => extensions.push((name, kind, vec![by])),
            }
        }
    }
    rows.extend(
        extensions.into_iter().map(|(name, kind, by)| Row { name, gate: format!("{kind}(&[{}])", by.join(", ")) }),
    );
    Ok(rows)
}

impl Writer<'_> {
    /// Adds a command's row, and its function unless another of its names did.
    fn add(&self, output: &mut Output, row: &Row<'_>) -> Result<(), Error> {
        let names = self.registry.command_names(row.name);
        let definition = self
            .registry
            .commands
            .get(names[0])
            .ok_or_else(|| Error::Support(format!("the registry has no command {}", row.name)))?;
        let function = self.declarations.function(self.registry, row.name)?;
        let entry_point = names.iter().find_map(|name| self.entry_points.get(*name));
        let line = match output.defined.iter().find(|defined| names.contains(&defined.as_str())) {
            Some(known) => tables::line(row.name, " =", known),
            None => {
                let text = self.function(row.name, definition, function, entry_point)?;
                output.functions.push_str(&text);
                output.defined.insert(row.name.to_owned());
                tables::line(row.name, ":", &function.ty)
            }
        };
        let block = format!("{}, {}", scope(row.name, definition), row.gate);
        match output.blocks.iter_mut().find(|(known, _)| *known == block) {
            Some((_, lines)) => lines.push(line),
            None => output.blocks.push((block, vec![line])),
        }
        Ok(())
    }

    /// The function of a command.
    fn function(
        &self,
        name: &str,
        definition: &registry::Command,
        function: &Function,
        entry_point: Option<&EntryPoint>,
    ) -> Result<String, Error> {
        let mut used = BTreeSet::from([function.parameters[0].name.clone()]);
        let body = match entry_point {
            Some(entry_point) => self.call(name, definition, function, entry_point, &mut used)?,
            None => match self.by_second_version(name, definition, function, &mut used)? {
                Some(body) => body,
                None => match self.dynamic_state(name, function, &mut used) {
                    Some(body) => body,
                    None => self.without_function(name, function, &mut used)?,
                },
            },
        };
        let mut parameters = String::new();
        for parameter in &function.parameters {
            let is_used = used.contains(&parameter.name);
            let shown = if is_used { &parameter.name } else { "_" };
            let _ = write!(parameters, "{shown}: {}, ", parameter.ty);
        }
        let output = function.output.as_ref().map_or_else(String::new, |output| format!("-> {output}"));
        let visibility = if name == "vkGetInstanceProcAddr" { "pub(crate) " } else { "" };
        let safety = "// SAFETY: the application follows Vulkan's valid usage.";
        let first = &function.parameters[0].name;
        let body = match body {
            Body::Recording(text) => format!("{safety}\nunsafe {{ record({first}, \"{name}\", |recorder| {text}) }}"),
            Body::Unsafe(text) => format!("{safety}\nguard({first}, \"{name}\", || unsafe {{ {text} }})"),
            Body::Safe(text) => format!("guard({first}, \"{name}\", || {text})"),
            Body::Refusal => format!("refuse({first}, \"{name}\")"),
        };
        Ok(format!("{visibility}unsafe extern \"system\" fn {name}({parameters}) {output} {{ {body} }}\n\n"))
    }

    /// The body of a command whose parameters are the members of the structure that its second version takes.
    fn by_second_version(
        &self,
        name: &str,
        definition: &registry::Command,
        function: &Function,
        used: &mut BTreeSet<String>,
    ) -> Result<Option<Body>, Error> {
        let second = format!("{name}2");
        let (Some(entry_point), Some(taken)) = (self.entry_points.get(&second), self.registry.commands.get(&second))
        else {
            return Ok(None);
        };
        let [_, info] = &taken.parameters[..] else {
            return Ok(None);
        };
        let structure = self.declarations.structure(self.registry, &info.ty)?;
        let mut lists = String::new();
        let mut members = String::new();
        for member in &structure.members {
            let Some(index) = function.parameters.iter().position(|p| p.name == member.name) else {
                return Ok(None);
            };
            let parameter = &function.parameters[index];
            used.insert(parameter.name.clone());
            let name = &member.name;
            if plain(&parameter.ty) == plain(&member.ty) {
                let _ = writeln!(members, "{name},");
                continue;
            }
            let (Some(element), Some(count)) =
                (member.ty.strip_prefix("* const "), count_of(definition, function, index))
            else {
                return Ok(None);
            };
            let list = without_prefix(name);
            let converted = self
                .declarations
                .structure(self.registry, &format!("Vk{}", plain(element)))?
                .members
                .iter()
                .map(|member| format!("{0}: of.{0},", member.name))
                .collect::<String>();
            let element = element.trim_end_matches("< '_ >");
            let _ = writeln!(
                lists,
                "let {list} = valid::slice({name}, {count})?.iter().map(|of| {element} {{
                    {converted} ..Default::default()
                }});
                let {list} = simdevice::host::collect({list});",
                count = count.name,
            );
            let _ = writeln!(members, "{name}: {list}.as_ptr(),");
        }
        let info = Info::new(self, "info", &info.ty)?;
        let mut arguments = Vec::new();
        for parameter in &entry_point.parameters {
            arguments.push(match parameter.name.as_str() {
                "recorder" | "_recorder" => "recorder".to_owned(),
                _ if plain(&parameter.ty) == format!("&{}", plain(&structure.ty)) => "&info".to_owned(),
                _ => match info.argument(self, parameter) {
                    Some((argument, _)) => argument,
                    None => return Ok(None),
                },
            });
        }
        Ok(Some(Body::Recording(format!(
            "{{
                {lists}
                let info = {ty} {{ {members} ..Default::default() }};
                {call}({arguments})
            }}",
            ty = tables::path(&structure.ty),
            call = entry_point.path,
            arguments = arguments.join(", "),
        ))))
    }

    /// The body of a command that sets a dynamic state whose value is its parameter.
    fn dynamic_state(&self, name: &str, function: &Function, used: &mut BTreeSet<String>) -> Option<Body> {
        let untagged = name.trim_end_matches(|letter: char| letter.is_ascii_uppercase());
        let row = self.dynamic_states.get(untagged)?;
        let (set, value) = match &function.parameters[1..] {
            [mask, value] if row.is_of_face => {
                used.insert(mask.name.clone());
                (format!("set_faces(recorder, {}, |face| ", mask.name), value)
            }
            [value] if !row.is_of_face => ("set(recorder, ".to_owned(), value),
            _ => return None,
        };
        used.insert(value.name.clone());
        let dynamic_states::Row { variant, value: field, .. } = row;
        let converted = convert_value(&row.ty, value)?;
        let value = if *field == converted { converted } else { format!("{field}: {converted}") };
        let face = if row.is_of_face { "face, " } else { "" };
        Some(Body::Recording(format!("{set}DynamicState::{variant} {{ {face}{value} }})")))
    }

    /// The body of a command for which the driver has no function.
    fn without_function(&self, name: &str, function: &Function, used: &mut BTreeSet<String>) -> Result<Body, Error> {
        if self.support.commands.no_op.contains_key(name) {
            return Ok(Body::Safe("Ok(())".to_owned()));
        }
        if self.support.commands.refused.contains_key(name) {
            let records = function.parameters[0].ty == "vk :: CommandBuffer";
            return Ok(if records { Body::Recording("recorder.refuse()".to_owned()) } else { Body::Refusal });
        }
        let last = function.parameters.iter().rev().find(|parameter| !parameter.ty.contains("AllocationCallbacks"));
        if let (Some(handle), true) = (last, name.starts_with("vkDestroy") || name == "vkFreeMemory") {
            used.insert(handle.name.clone());
            return Ok(Body::Unsafe(format!("handle::destroy({})", handle.name)));
        }
        Err(Error::EntryPoint(format!(
            "{name} has no function (with #[doc(alias = \"{name}\")]), and support.toml neither refuses it nor says that \
             it does nothing"
        )))
    }

    /// The body of a command that calls the driver's function for it.
    fn call(
        &self,
        name: &str,
        definition: &registry::Command,
        function: &Function,
        entry_point: &EntryPoint,
        used: &mut BTreeSet<String>,
    ) -> Result<Body, Error> {
        let wrong = |text: String| Error::EntryPoint(format!("{}: {text}", entry_point.path));
        let mut is_unsafe = entry_point.is_unsafe;
        let mut arguments = Vec::new();
        let mut records = false;
        let mut info = None;
        for parameter in &entry_point.parameters {
            if matches!(parameter.name.as_str(), "recorder" | "_recorder") {
                records = true;
                arguments.push("recorder".to_owned());
                continue;
            }
            if plain(&parameter.ty) == "&Commands" {
                arguments.push("&COMMANDS".to_owned());
                continue;
            }
            let index = function
                .parameters
                .iter()
                .position(|declared| without_prefix(&declared.name) == parameter.name.trim_start_matches('_'));
            let Some(index) = index else {
                let found = self.info(definition, function);
                let argument = found.as_ref().and_then(|(_, info)| info.argument(self, parameter));
                let (Some((pointer, _)), Some((argument, converts))) = (found, argument) else {
                    return Err(wrong(format!(
                        "{name} has no parameter {}, but {}",
                        parameter.name,
                        list_names(&function.parameters)
                    )));
                };
                is_unsafe |= converts;
                info = Some(pointer);
                arguments.push(argument);
                continue;
            };
            let declared = &function.parameters[index];
            let count = count(definition, function, index);
            let (argument, converts) = convert(&parameter.ty, declared, count.as_ref()).ok_or_else(|| {
                wrong(format!("{} of type {} is not made of {}", parameter.name, parameter.ty, declared.ty))
            })?;
            is_unsafe |= converts;
            used.insert(declared.name.clone());
            if let Some(count) = count.filter(|count| argument.contains(&count.expression)) {
                used.insert(count.parameter);
            }
            arguments.push(argument);
        }
        let mut input = String::new();
        if let Some(pointer) = info {
            let pointee = format!("valid::input({pointer})?");
            input = format!("let info = {pointee};");
            arguments.iter_mut().filter(|argument| **argument == pointee).for_each(|it| *it = "info".to_owned());
            used.insert(pointer);
            is_unsafe = true;
        }
        let call = format!("{}({})", entry_point.path, arguments.join(", "));
        if records {
            return Ok(Body::Recording(if input.is_empty() { call } else { format!("{{ {input} {call} }}") }));
        }
        let (body, writes) = write_output(&entry_point.output, function, used, call)
            .ok_or_else(|| wrong(format!("nothing takes a {}", entry_point.output)))?;
        Ok(if is_unsafe || writes { Body::Unsafe(format!("{input} {body}")) } else { Body::Safe(body) })
    }

    /// The structure with a command's parameters, and the parameter that points at it.
    fn info<'s>(&'s self, definition: &'s registry::Command, function: &Function) -> Option<(String, Info<'s>)> {
        let parameters = std::iter::zip(&definition.parameters, &function.parameters);
        parameters.filter(|(defined, declared)| defined.len.is_none() && declared.ty.starts_with("* const")).find_map(
            |(defined, declared)| {
                let info = Info::new(self, "info", &defined.ty).ok()?;
                Some((declared.name.clone(), info))
            },
        )
    }
}

/// A structure whose members are parameters of the driver's function.
struct Info<'a> {
    /// The variable that refers to it.
    variable: &'static str,
    /// Its name in the registry.
    name: &'a str,
    structure: &'a registry::Structure,
    /// Its declaration, whose members are in the same order.
    declared: &'a ash::Structure,
}

impl<'a> Info<'a> {
    fn new(writer: &'a Writer<'_>, variable: &'static str, name: &'a str) -> Result<Self, Error> {
        let Writer { registry, declarations, .. } = writer;
        let undeclared = || Error::Undeclared(name.to_owned());
        let last = registry.type_name(name);
        let structure = registry.structures.get(last).ok_or_else(undeclared)?;
        let declared = declarations.structure(registry, name)?;
        if structure.members.len() != declared.members.len() {
            return Err(undeclared());
        }
        Ok(Self { variable, name: last, structure, declared })
    }

    /// A member, or a structure of the chain, converted to the form of a parameter of the driver's function; and true
    /// if the conversion is unsafe.
    fn argument(&self, writer: &Writer<'_>, wanted: &Member) -> Option<(String, bool)> {
        let variable = self.variable;
        let place = |index: usize| format!("{variable}.{}", self.declared.members[index].name);
        let name = wanted.name.trim_start_matches('_');
        let members = &self.declared.members;
        if let Some(index) = members.iter().position(|m| without_prefix(&m.name) == name) {
            let len = self.structure.members[index].len.as_deref();
            let count = self.structure.members.iter().position(|m| Some(&*m.name) == len);
            let count = count.map(|count| Count {
                parameter: variable.to_owned(),
                expression: place(count),
                ty: plain(&members[count].ty),
            });
            let member = Member { name: place(index), ty: members[index].ty.clone() };
            return convert(&wanted.ty, &member, count.as_ref());
        }
        let ty = plain(&wanted.ty);
        let chained = ty.strip_prefix("Option<&")?.strip_suffix('>')?;
        let chained = format!("Vk{chained}");
        let structure = writer.registry.structures.get(writer.registry.type_name(&chained))?;
        let extends = structure.extends.iter().any(|base| base == self.name);
        let declared = writer.declarations.structure(writer.registry, &chained).ok()?;
        extends.then(|| {
            let ty = &declared.ty;
            (format!("valid::find_in_chain::<{ty}>({variable}.p_next)"), true)
        })
    }
}

/// The condition under which a command may be looked up.
fn scope(name: &str, definition: &registry::Command) -> &'static str {
    if name == "vkGetInstanceProcAddr" {
        return "Global";
    }
    match definition.parameters.first().map(|first| first.ty.as_str()) {
        Some("VkInstance") => "Instance",
        Some("VkPhysicalDevice") => "PhysicalDevice",
        Some("VkDevice" | "VkQueue" | "VkCommandBuffer") => "Device",
        _ => "Global",
    }
}

/// A type without spaces, paths and lifetimes, to be compared and parsed.
fn plain(ty: &str) -> String {
    let text: String = ty.split_whitespace().collect();
    text.replace("std::ffi::", "")
        .replace("gaurast::vk::", "")
        .replace("vk::", "")
        .replace("<'_>", "")
        .replace("'_", "")
        // The length of an array.
        .replace("usize]", "]")
}

fn without_prefix(name: &str) -> &str {
    name.strip_prefix("pp_").or_else(|| name.strip_prefix("p_")).unwrap_or(name)
}

fn list_names(parameters: &[Member]) -> String {
    let names: Vec<&str> = parameters.iter().map(|p| without_prefix(&p.name)).collect();
    names.join(", ")
}

/// The parameter with the number of elements of another.
fn count_of<'a>(definition: &registry::Command, function: &'a Function, index: usize) -> Option<&'a Member> {
    let len = definition.parameters.get(index)?.len.as_deref()?;
    let index = definition.parameters.iter().position(|p| p.name == len)?;
    function.parameters.get(index)
}

/// The number of elements of a parameter.
struct Count {
    /// The parameter that contains the number.
    parameter: String,
    /// The expression for the number: the parameter, or a member of it.
    expression: String,
    /// The number's type.
    ty: String,
}

/// The number of elements of a parameter: another parameter, or a member of the structure that one points at.
fn count(definition: &registry::Command, function: &Function, index: usize) -> Option<Count> {
    if let Some(count) = count_of(definition, function, index) {
        return Some(Count { parameter: count.name.clone(), expression: count.name.clone(), ty: plain(&count.ty) });
    }
    let len = definition.parameters.get(index)?.len.as_deref()?;
    let (parameter, member) = len.split_once("->")?;
    let index = definition.parameters.iter().position(|p| p.name == parameter)?;
    let parameter = function.parameters.get(index)?.name.clone();
    Some(Count {
        expression: format!("valid::input({parameter})?.{}", rust::snake_case(member)),
        parameter,
        ty: "u32".to_owned(),
    })
}

/// A parameter converted to the form of the function's parameter; and true if the conversion is unsafe.
fn convert(wanted: &str, declared: &Member, count: Option<&Count>) -> Option<(String, bool)> {
    let (wanted, raw, name) = (plain(wanted), plain(&declared.ty), &declared.name);
    if wanted == raw {
        return Some((name.clone(), false));
    }
    if wanted == "bool" && raw == "Bool32" {
        return Some((format!("{name} != vk::FALSE"), false));
    }
    let conversion = if let Some(pointee) = raw.strip_prefix("*mut") {
        if wanted == format!("&mut{pointee}") {
            format!("valid::output_structure({name})?")
        } else if wanted == format!("OutputChain<,{pointee}>") {
            format!("OutputChain::new({name})?")
        } else if wanted == format!("Structures<,{pointee}>") {
            format!("Structures::new({}, {name})?", count?.expression)
        } else if let Some(element) = wanted.strip_prefix("&mut[MaybeUninit<") {
            let Count { expression, ty, .. } = count?;
            let cast = if ty == "usize" { "" } else { " as usize" };
            let place = match (element, pointee) {
                ("u8>]", "c_void") => format!("{name}.cast::<u8>()"),
                _ if element == format!("{pointee}>]") => name.clone(),
                _ => return None,
            };
            format!("valid::output_slice({place}, {expression}{cast})?")
        } else {
            return None;
        }
    } else if let Some(pointee) = raw.strip_prefix("*const") {
        if wanted == format!("&{pointee}") {
            format!("valid::input({name})?")
        } else if wanted == format!("Option<&{pointee}>") {
            format!("valid::optional({name})")
        } else if wanted == "&CStr" && pointee == "c_char" {
            format!("valid::string({name}).ok_or(Error::NullPointer {{ what: \"{name}\" }})?")
        } else if wanted == "Option<&CStr>" && pointee == "c_char" {
            format!("valid::string({name})")
        } else {
            let count = &count?.expression;
            let slice = format!("valid::slice({name}, {count})?");
            if wanted == format!("&[{pointee}]") {
                slice
            } else if wanted == "&[u8]" && pointee == "c_void" {
                format!("valid::slice({name}.cast::<u8>(), {count})?")
            } else if wanted == format!("Handles<,{pointee}>") {
                format!("handle::Handles::new({slice})")
            } else if wanted == format!("Option<Handles<,{pointee}>>") {
                format!(
                    "(!{name}.is_null()).then(|| valid::slice({name}, {count})).transpose()?.map(|them| handle::Handles::new(them))"
                )
            } else if wanted.starts_with("&[Arc<") {
                format!("&handle::get_all({slice})?")
            } else if wanted.starts_with("&[Option<Arc<") {
                format!("&handle::get_all_optional({slice})?")
            } else if wanted == format!("Option<&[{pointee}]>") {
                format!("(!{name}.is_null()).then(|| valid::slice({name}, {count})).transpose()?")
            } else {
                return None;
            }
        }
    } else if wanted.starts_with("Option<Arc<") {
        format!("handle::destroy({name})?")
    } else if wanted.starts_with("Option<&Arc<") {
        format!("handle::get_optional({name})?")
    } else if wanted.starts_with("Option<&") {
        format!("handle::get_optional({name})?.map(AsRef::as_ref)")
    } else if wanted.starts_with('&') {
        format!("handle::get({name})?")
    } else {
        return None;
    };
    Some((conversion, true))
}

/// A parameter converted to the value of a dynamic state; stencil masks are as wide as stencil texels.
fn convert_value(wanted: &str, declared: &Member) -> Option<String> {
    let (ty, raw, name) = (plain(wanted), plain(&declared.ty), &declared.name);
    if raw.strip_prefix("*const") == Some(&ty) {
        return Some(format!("*valid::input({name})?"));
    }
    if ty == "u8" && raw == "u32" {
        return Some(format!("{name} as u8"));
    }
    match convert(wanted, declared, None)? {
        (value, false) => Some(value),
        _ => None,
    }
}

/// A call whose result is written to the command's output; and true if that is unsafe.
fn write_output(
    output: &str,
    function: &Function,
    used: &mut BTreeSet<String>,
    call: String,
) -> Option<(String, bool)> {
    let output = plain(output);
    if output == "()" || output == "Result" || Some(&output) == function.output.as_deref().map(plain).as_ref() {
        return Some((call, false));
    }
    let Member { name, ty } = function.parameters.last()?;
    let (variable, ty) = (without_prefix(name), plain(ty));
    let pointee = ty.strip_prefix("*mut")?;
    used.insert(name.clone());
    let written = if output == pointee {
        format!("valid::output({name}, {variable})")
    } else if output.starts_with("Arc<") {
        format!("valid::output({name}, handle::create({variable}))")
    } else if output == format!("Vec<{pointee}>") || output.starts_with(&format!("[{pointee};")) {
        let count = &function.parameters.iter().rev().nth(1)?.name;
        used.insert(count.clone());
        format!("valid::enumerate({count}, {name}, &{variable})")
    } else {
        return None;
    };
    Some((format!("let {variable} = {call}?; {written}"), true))
}
