//! Tests that the ids of valid usage in the driver's messages are in Vulkan's specification, or the extension's own.

use gaurast_runner::Need;
use registry_gen::repository;
use std::collections::BTreeSet;
use std::path::Path;

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}

/// The ids of Vulkan's specification, as Debian's package of the headers has them.
const VALID_USAGE: &str = "/usr/share/vulkan/registry/validusage.json";

/// Ids that the package's version, Vulkan 1.3.239, lacks, and that Vulkan 1.4 has.
const NEWER: [&str; 31] = [
    "VUID-RuntimeSpirv-OpEntryPoint-08743",
    "VUID-VkComputePipelineCreateInfo-layout-07988",
    "VUID-VkCopyImageToImageInfo-dstImage-07966",
    "VUID-VkCopyImageToImageInfo-dstSubresource-07967",
    "VUID-VkCopyImageToImageInfo-dstSubresource-07968",
    "VUID-VkCopyImageToImageInfo-dstSubresource-09105",
    "VUID-VkCopyImageToImageInfo-srcImage-07966",
    "VUID-VkCopyImageToImageInfo-srcSubresource-07967",
    "VUID-VkCopyImageToImageInfo-srcSubresource-07968",
    "VUID-VkCopyImageToImageInfo-srcSubresource-09105",
    "VUID-VkCopyImageToMemoryInfo-imageSubresource-07967",
    "VUID-VkCopyImageToMemoryInfo-imageSubresource-07968",
    "VUID-VkCopyImageToMemoryInfo-imageSubresource-07971",
    "VUID-VkCopyImageToMemoryInfo-imageSubresource-09105",
    "VUID-VkCopyImageToMemoryInfo-srcImage-07966",
    "VUID-VkCopyMemoryToImageInfo-dstImage-07966",
    "VUID-VkCopyMemoryToImageInfo-imageSubresource-07967",
    "VUID-VkCopyMemoryToImageInfo-imageSubresource-07968",
    "VUID-VkCopyMemoryToImageInfo-imageSubresource-07971",
    "VUID-VkCopyMemoryToImageInfo-imageSubresource-09105",
    "VUID-VkDepthBiasRepresentationInfoEXT-depthBiasRepresentation-parameter",
    "VUID-VkGraphicsPipelineCreateInfo-Input-07904",
    "VUID-VkGraphicsPipelineCreateInfo-Input-08733",
    "VUID-VkGraphicsPipelineCreateInfo-layout-07988",
    "VUID-VkImageToMemoryCopy-aspectMask-09103",
    "VUID-VkMemoryAllocateInfo-allocationSize-07899",
    "VUID-VkMemoryToImageCopy-aspectMask-09103",
    "VUID-VkPipelineShaderStageCreateInfo-stage-08771",
    "VUID-VkShaderModuleCreateInfo-pCode-08738",
    "VUID-VkShaderModuleCreateInfo-pCode-08740",
    "VUID-vkCmdPushDescriptorSetWithTemplateKHR-descriptorUpdateTemplate-07994",
];

/// Recorded commands that the package's version lacks, without `vkCmd`. Every such command has the rule.
const NEWER_COMMANDS: [&str; 13] = [
    "BindDescriptorSets2",
    "BindIndexBuffer2",
    "PushConstants2",
    "PushDescriptorSet",
    "PushDescriptorSet2",
    "PushDescriptorSetWithTemplate",
    "PushDescriptorSetWithTemplate2",
    "SetAttachmentFeedbackLoopEnableEXT",
    "SetDepthBias2EXT",
    "SetLineStipple",
    "SetPrimitiveRestartIndexEXT",
    "SetRenderingAttachmentLocations",
    "SetRenderingInputAttachmentIndices",
];

/// Collects the ids in a text.
fn ids(text: &str, found: &mut BTreeSet<String>) {
    for (start, _) in text.match_indices("VUID-") {
        let rest = &text[start..];
        let is_of_id = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
        let end = rest.find(|letter| !is_of_id(letter)).unwrap_or(rest.len());
        found.insert(rest[..end].to_owned());
    }
}

/// Collects the ids in the files of a folder and its subfolders.
fn ids_of_folder(folder: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                ids(&std::fs::read_to_string(path).expect("text"), &mut found);
            }
        }
    }
    found
}

#[gaurast_runner::test(needs = [Need::File(VALID_USAGE)])]
fn messages_name_rules_that_there_are() {
    let text = std::fs::read_to_string(VALID_USAGE).expect("a file that was just looked at");
    let mut known = ids_of_folder(&repository().join("api/spec"));
    ids(&text, &mut known);
    assert!(known.len() > 10_000, "{} ids", known.len());

    let named = ids_of_folder(&repository().join("driver/src"));
    // A command's name is inserted into these ids; the next test checks them.
    let is_whole = |id: &&String| !matches!(id.as_str(), "VUID-" | "VUID--");
    let unknown: Vec<_> =
        named.iter().filter(is_whole).filter(|id| !known.contains(*id) && !NEWER.contains(&id.as_str())).collect();
    assert!(unknown.is_empty(), "{unknown:#?}");
    for newer in NEWER {
        assert!(named.contains(newer), "{newer} is named no more");
    }
}

/// Tests the ids that are completed with the name of the recorded command.
#[gaurast_runner::test(needs = [Need::File(VALID_USAGE)])]
fn every_recorded_command_must_be_in_a_recording() {
    let text = std::fs::read_to_string(VALID_USAGE).expect("a file that was just looked at");
    let mut known = ids_of_folder(&repository().join("api/spec"));
    ids(&text, &mut known);
    let commands = repository().join("driver/src/dispatch/commands.rs");
    let commands = std::fs::read_to_string(commands).expect("the generated commands");
    let commands: String = commands.split_whitespace().collect();
    let names = commands
        .split("(command_buffer,\"vkCmd")
        .skip(1)
        .filter_map(|rest| rest.split_once('"'))
        // The extension's text leaves out implicit valid usage, because that is generated.
        .filter(|(name, _)| !name.ends_with("GAURAST"));
    let (with_rule, newer): (BTreeSet<&str>, BTreeSet<&str>) = names
        .map(|(name, _)| name)
        .partition(|name| known.contains(&format!("VUID-vkCmd{name}-commandBuffer-recording")));
    assert_eq!(newer, BTreeSet::from(NEWER_COMMANDS));
    assert!(with_rule.len() > 70, "{} commands are recorded", with_rule.len());
}
