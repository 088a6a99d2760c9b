//! Writes the extensions in Rust, in the form of the extensions that ash contains.

use super::comment::Comments;
use super::extension::{Command, Enum, Extension, Member, Structure, TAG, rust_constant, rust_file, rust_name};
use crate::error::Error;
use crate::rust::snake_case;
use std::collections::BTreeSet;
use std::fmt::Write;

/// A number with underscores between its thousands.
fn grouped(number: i64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('_');
        }
        text.push(digit);
    }
    text
}

/// The Rust type of a C scalar or a C name.
fn base_type(name: &str) -> String {
    match name {
        "void" => "c_void".to_owned(),
        "char" => "c_char".to_owned(),
        "size_t" => "usize".to_owned(),
        "float" => "f32".to_owned(),
        "double" => "f64".to_owned(),
        "uint32_t" => "u32".to_owned(),
        "uint64_t" => "u64".to_owned(),
        _ if name.ends_with(TAG) => rust_name(name).to_owned(),
        _ => format!("vk::{}", rust_name(name)),
    }
}

/// The type of a member in Rust.
fn rust_type(member: &Member) -> String {
    let base = base_type(&member.ty);
    if member.is_pointer {
        let kind = if member.is_const { "const" } else { "mut" };
        let lifetime = if member.ty.ends_with(TAG) { "<'_>" } else { "" };
        return format!("*{kind} {base}{lifetime}");
    }
    let lengths = member.lengths.iter().rev();
    lengths.fold(base, |ty, length| format!("[{ty}; {length}]"))
}

/// The module of structures, enums, constants and function types.
pub(super) fn definitions(extensions: &[Extension], defaults: &BTreeSet<String>) -> Result<String, Error> {
    let mut code = String::new();
    extensions.iter().for_each(|extension| add_definitions(&mut code, extension, defaults));
    rust_file(
        "//! The extensions' structures, enums, flags, constants and function types.",
        &format!(
            "use core::ffi::{{c_char, c_void}};
            use core::marker::PhantomData;

            use ash::vk;

            use crate::ash_compat::{{
                bool_setters, extended_structure, setters, tagged_structure, vk_enum, vk_flags
            }};

            {code}"
        ),
    )
}

fn add_definitions(code: &mut String, extension: &Extension, defaults: &BTreeSet<String>) {
    let comments = Comments { extension, path: "" };
    for constant in &extension.constants {
        let _ = writeln!(
            code,
            "{}pub const {}: u32 = {};\n",
            comments.item(&constant.name, &constant.comment, None),
            rust_constant(&constant.name),
            constant.value.replace(['(', ')', 'U'], "").replace('~', "!")
        );
    }
    for added in &extension.added {
        let ty = rust_name(&added.of);
        let _ = writeln!(
            code,
            "{}pub const {}: vk::{ty} = vk::{ty}::from_raw({});\n",
            comments.item(&added.name, &added.comment, None),
            rust_constant(&added.name),
            grouped(added.value)
        );
    }
    for of in &extension.enums {
        add_enum(code, comments, of);
    }
    for callback in &extension.callbacks {
        let parameters: String = callback.parameters.iter().map(declaration).collect();
        let _ = writeln!(
            code,
            "{}#[allow(non_camel_case_types, reason = \"the name is Vulkan's\")]
            pub type {} = Option<unsafe extern \"system\" fn({parameters})>;\n",
            comments.text(&callback.comment, None),
            callback.name
        );
    }
    for structure in &extension.structures {
        add_structure(code, comments, structure, defaults);
    }
    for command in &extension.commands {
        let parameters: String = command.parameters.iter().map(declaration).collect();
        let _ = writeln!(
            code,
            "/// The type of `{0}`.
            #[allow(non_camel_case_types, reason = \"the name is Vulkan's\")]
            pub type PFN_{0} = unsafe extern \"system\" fn({parameters});\n",
            command.name
        );
    }
}

fn declaration(member: &Member) -> String {
    format!("{}: {},", member.rust_name(), rust_type(member))
}

fn add_enum(code: &mut String, comments: Comments<'_>, of: &Enum) {
    let kind = if of.is_flags { "vk_flags" } else { "vk_enum" };
    let name = of.type_name();
    let mut values = String::new();
    for value in &of.values {
        let _ = writeln!(
            values,
            "{}        {} = {},",
            indented(&comments.item(&value.name, &value.comment, None), 8),
            of.short_name(value),
            value.value
        );
    }
    // rustfmt does not format the arguments of macros.
    let _ = writeln!(
        code,
        "{kind}! {{\n{}    pub struct {} {{\n{values}    }}\n}}\n",
        indented(&comments.item(&name, &of.comment, None), 4),
        rust_name(&name)
    );
}

fn indented(text: &str, by: usize) -> String {
    let mut indented = String::new();
    for line in text.lines() {
        let _ = writeln!(indented, "{:by$}{line}", "");
    }
    indented
}

fn add_structure(code: &mut String, comments: Comments<'_>, structure: &Structure, defaults: &BTreeSet<String>) {
    let name = rust_name(&structure.name);
    let is_tagged = structure.structure_type.is_some();
    let (declared, any) = if is_tagged { ("<'a>", "<'_>") } else { ("", "") };
    let has_floats = structure.members.iter().any(|member| matches!(&*member.ty, "float" | "double"));
    let traits = match (is_tagged, has_floats) {
        (true, _) => "Copy, Clone",
        (false, true) => "Copy, Clone, PartialEq",
        (false, false) => "Copy, Clone, PartialEq, Eq, Hash",
    };
    let mut fields = String::new();
    for member in &structure.members {
        let comment = match &*member.name {
            "sType" => "The structure's type.",
            "pNext" => "The next structure of the chain, or null.",
            _ => &member.comment,
        };
        let _ = writeln!(fields, "{}pub {}", comments.text(comment, Some(structure)), declaration(member));
    }
    if is_tagged {
        fields.push_str("/// The lifetime of the `p_next` chain.\npub _marker: PhantomData<&'a ()>,\n");
    }
    let _ = writeln!(
        code,
        "{}#[repr(C)]
        #[derive({traits})]
        #[cfg_attr(feature = \"debug\", derive(Debug))]
        #[must_use]
        pub struct {name}{declared} {{ {fields} }}\n",
        comments.item(&structure.name, &structure.comment, Some(structure))
    );
    if let Some(structure_type) = &structure.structure_type {
        let extends = structure.extends.iter();
        let extends: String = extends.map(|name| format!(", {}", extends_trait(name))).collect();
        let _ = writeln!(code, "tagged_structure!({name} = {}{extends});\n", rust_constant(structure_type));
    }
    if comments.extension.extending(&structure.name).next().is_some() {
        let _ = writeln!(code, "extended_structure!({name}, {});\n", extends_trait(&structure.name));
    }
    if !defaults.contains(name) {
        let values: String = structure.members.iter().map(default_value).collect();
        let marker = if is_tagged { "_marker: PhantomData," } else { "" };
        let _ = writeln!(
            code,
            "impl Default for {name}{any} {{
                #[inline]
                fn default() -> Self {{ Self {{ {values} {marker} }} }}
            }}\n"
        );
    }
    let _ = writeln!(code, "impl {name}{any} {{\n{}}}\n", setters(structure));
}

/// The path of the trait of the structures that extend the one of a C name.
fn extends_trait(name: &str) -> String {
    let module = if name.ends_with(TAG) { "" } else { "vk::" };
    format!("{module}Extends{}", rust_name(name))
}

/// A member with its default.
fn default_value(member: &Member) -> String {
    let value = match (&*member.name, member.is_pointer, member.is_const) {
        ("sType", ..) => "<Self as vk::TaggedStructure>::STRUCTURE_TYPE".to_owned(),
        (_, true, true) => "core::ptr::null()".to_owned(),
        (_, true, false) => "core::ptr::null_mut()".to_owned(),
        _ if member.lengths.is_empty() => format!("{}::default()", rust_type(member)),
        _ => format!("<{}>::default()", rust_type(member)),
    };
    format!("{}: {value},\n", member.rust_name())
}

/// The calls of the macros that write setters.
fn setters(structure: &Structure) -> String {
    let (mut bools, mut others) = (String::new(), String::new());
    for member in &structure.members {
        if matches!(&*member.name, "sType" | "pNext") {
            continue;
        }
        if member.ty == "VkBool32" {
            let _ = writeln!(bools, "        {},", member.rust_name());
        } else {
            let ty = rust_type(member);
            let _ = writeln!(others, "        {}: {ty},", member.rust_name());
        }
    }
    let call = |name: &str, arguments: String| {
        if arguments.is_empty() {
            return String::new();
        }
        format!("    {name}! {{\n{arguments}    }}\n")
    };
    call("bool_setters", bools) + &call("setters", others)
}

/// The module of an extension that has no functions.
pub(super) fn names(extension: &Extension) -> Result<String, Error> {
    let documentation = format!("//! `{}`: name and version.", extension.name);
    rust_file(&documentation, &format!("use core::ffi::CStr;\n\n{}", name_constants(extension)))
}

/// The constants with the extension's name, revision and number.
fn name_constants(extension: &Extension) -> String {
    let Extension { name, number, revision, .. } = extension;
    format!(
        "/// The extension's name, for `ppEnabledExtensionNames`.
        pub const NAME: &CStr = c\"{name}\";

        /// The revision of the extension that this crate describes.
        pub const SPEC_VERSION: u32 = {revision};

        /// The extension number, which fixes the block of enum values: 1000000000 + (number - 1) * 1000.
        ///
        /// It is not registered with Khronos. It is far above the numbers that are.
        pub const EXTENSION_NUMBER: u32 = {number};
        "
    )
}

/// The module of the extension's name and functions.
pub(super) fn functions(extension: &Extension) -> Result<String, Error> {
    let comments = Comments { extension, path: "crate::vk::" };
    let (mut calls, mut pointers, mut loads) = (String::new(), String::new(), String::new());
    for command in &extension.commands {
        add_command(&mut calls, comments, command);
        let (name, field) = (&command.name, field_name(command));
        let _ = writeln!(pointers, "/// `{name}`.\npub {field}: PFN_{name},");
        let parameters: String =
            command.parameters.iter().map(|parameter| format!("_{}", declaration(parameter))).collect();
        let _ = writeln!(
            loads,
            "{field}: {{
                unsafe extern \"system\" fn {field}({parameters}) {{
                    panic!(\"Unable to load {field}\")
                }}
                let function = load(c\"{name}\");
                if function.is_null() {{
                    {field}
                }} else {{
                    // SAFETY: the loader returns the function of that name, which has this type.
                    unsafe {{ core::mem::transmute::<*const c_void, PFN_{name}>(function) }}
                }}
            }},"
        );
    }
    let types: BTreeSet<String> = extension
        .commands
        .iter()
        .flat_map(|command| {
            let types = command.parameters.iter().map(|parameter| &parameter.ty);
            let types = types.filter(|ty| ty.ends_with(TAG));
            types.map(|ty| rust_name(ty).to_owned()).chain([format!("PFN_{}", command.name)])
        })
        .collect();
    let types: Vec<String> = types.into_iter().collect();
    let Extension { name, .. } = extension;
    let constants = name_constants(extension);
    rust_file(
        &format!(
            "//! `{name}`: names, version and device-level functions.
//!
//! The module has the shape of ash's own extension modules (see [`ash::ext::mesh_shader`])."
        ),
        &format!(
            "use core::ffi::{{CStr, c_void}};

            use ash::vk;

            use crate::ash_compat;
            use crate::vk::{{{types}}};

            {constants}
            /// {name} device-level functions.
            #[derive(Clone)]
            pub struct Device {{
                fp: DeviceFn,
                handle: vk::Device,
            }}

            impl Device {{
                /// Loads the functions of `device`, on which the extension must be enabled.
                ///
                /// As everywhere in ash, a function that the device lacks is only noticed when it is called:
                /// the call then ends the process with a message.
                pub fn new(instance: &ash::Instance, device: &ash::Device) -> Self {{
                    let handle = device.handle();
                    let fp = DeviceFn::load(ash_compat::device_loader(instance, handle));
                    Self {{ fp, handle }}
                }}

                /// The raw function pointers.
                #[inline]
                pub fn fp(&self) -> &DeviceFn {{
                    &self.fp
                }}

                /// The device whose functions these are.
                #[inline]
                pub fn device(&self) -> vk::Device {{
                    self.handle
                }}

                {calls}
            }}

            /// Raw {name} device-level function pointers.
            #[derive(Clone)]
            pub struct DeviceFn {{ {pointers} }}

            impl DeviceFn {{
                /// Loads every function through `load`, which takes a function's name and returns its address,
                /// or null where there is none.
                ///
                /// What `load` returns must be null or the function of that name.
                pub fn load<F: FnMut(&CStr) -> *const c_void>(mut load: F) -> Self {{
                    Self {{ {loads} }}
                }}
            }}
            ",
            types = types.join(", ")
        ),
    )
}

/// The name of a command's function pointer.
fn field_name(command: &Command) -> String {
    let name = command.name.trim_start_matches("vk").replace(TAG, "");
    let name = snake_case(&name);
    format!("{}_{}", name.trim_start_matches('_'), TAG.to_lowercase())
}

/// Adds the method that calls a command's function: pointers to structures are references, and arrays with their counts
/// are slices.
fn add_command(calls: &mut String, comments: Comments<'_>, command: &Command) {
    let field = field_name(command);
    let tag = format!("_{}", TAG.to_lowercase());
    let (mut parameters, mut arguments) = (String::new(), String::new());
    for parameter in &command.parameters {
        let name = parameter.rust_name();
        let ty = rust_type(parameter);
        let counts = |array: &&Member| array.counted_by.as_ref() == Some(&parameter.name);
        if let Some(array) = command.parameters.iter().find(counts) {
            let array = array.rust_name();
            let _ = write!(arguments, "{}.len() as u32,", array.trim_start_matches("p_"));
            continue;
        }
        let pointee = ty.strip_prefix("*const ");
        if let (Some(_), Some(pointee)) = (&parameter.counted_by, pointee) {
            let name = name.trim_start_matches("p_");
            let _ = write!(parameters, "{name}: &[{pointee}],");
            let _ = write!(arguments, "{name}.as_ptr(),");
            continue;
        }
        let (name, ty) = match (name.strip_prefix("p_"), pointee) {
            (Some(name), Some(pointee)) => (name.to_owned(), format!("&{pointee}")),
            _ => (name, ty),
        };
        let _ = write!(parameters, "{name}: {ty},");
        let _ = write!(arguments, "{name},");
    }
    let _ = writeln!(
        calls,
        "{documentation}
        ///
        /// # Safety
        ///
        /// The valid usage of `{name}`, which the extension's specification states: handles belong to
        /// [`Self::device`], access to them is synchronised, and structures and their `p_next` chains are valid.
        #[doc(alias = \"{name}\")]
        #[inline]
        pub unsafe fn {method}(&self, {parameters}) {{
            // SAFETY: the caller keeps the function's contract; references are live.
            unsafe {{ (self.fp.{field})({arguments}); }}
        }}",
        documentation = comments.text(&command.comment, None).trim_end(),
        name = command.name,
        method = field.trim_end_matches(&tag),
    );
}
