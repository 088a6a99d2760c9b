//! The numbers of indirect draws, in buffers.

use crate::facts::Facts;
use crate::recording::{Call, Indirect};
use crate::report::Faults;
use crate::rules::reader::Reader;

/// Checks a command as it is recorded.
pub(crate) fn check_command(call: &Indirect, facts: &Facts, faults: &mut Faults) {
    if call.counted.is_some() && call.count == 0 {
        return faults
            .warning("GAURAST-Draw-indirect-count", "maxDrawCount is 0: nothing is drawn, whatever the count is");
    }
    let name = if call.is_indexed { "vkCmdDrawIndexedIndirect" } else { "vkCmdDrawIndirect" };
    if call.counted.is_none() && call.count > 1 && !facts.has_multi_draw_indirect {
        let id = if call.is_indexed {
            "VUID-vkCmdDrawIndexedIndirect-drawCount-02718"
        } else {
            "VUID-vkCmdDrawIndirect-drawCount-02718"
        };
        faults.error(
            id,
            format!("drawCount of {name} is {}, but the feature multiDrawIndirect is not enabled", call.count),
        );
    }
}

/// Warns of a stride of 20 bytes for numbers that are 16 apart: those of an indexed draw are 20.
pub(crate) fn check_stride(indirect: &Indirect, number: u32, reader: &dyn Reader, faults: &mut Faults) {
    if indirect.is_indexed || indirect.stride != 20 || number < 2 {
        return;
    }
    let are_single = |stride: u32| {
        let strided = Indirect { stride, ..*indirect };
        let mut calls = (0..number.min(64)).map(|index| call(&strided, index, reader));
        calls.all(|call| matches!(call, Some(Call::Vertices([_, _, _, 1]))))
    };
    if are_single(16) && !are_single(20) {
        faults.warning(
            "GAURAST-Draw-indirect-stride",
            "the stride is 20, the size of a VkDrawIndexedIndirectCommand, but the VkDrawIndirectCommands in the buffer are \
             16 bytes apart",
        );
    }
}

fn word(bytes: &[u8], index: usize) -> Option<u32> {
    let bytes = bytes.get(4 * index..)?.get(..4)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}

/// The number of draws of a command, if it is known.
pub(crate) fn number(call: &Indirect, reader: &dyn Reader, faults: &mut Faults) -> Option<u32> {
    let Some((buffer, offset)) = call.counted else {
        return Some(call.count);
    };
    let number = word(&reader.read(buffer, offset, 4)?, 0)?;
    if number > call.count {
        faults.warning(
            "GAURAST-Draw-indirect-count",
            format!(
                "the count in the buffer is {number}, but maxDrawCount is {}: the others are not drawn",
                call.count
            ),
        );
    }
    Some(number.min(call.count))
}

/// A draw of a command, if its numbers are known.
pub(crate) fn call(call: &Indirect, index: u32, reader: &dyn Reader) -> Option<Call> {
    let offset = call.offset.checked_add(u64::from(index) * u64::from(call.stride))?;
    let bytes = reader.read(call.buffer, offset, if call.is_indexed { 20 } else { 16 })?;
    let word = |index: usize| word(&bytes, index);
    let (count, instances, first) = (word(0)?, word(1)?, word(2)?);
    Some(if call.is_indexed {
        Call::Indices([first, count, word(4)?, instances], word(3)?.cast_signed())
    } else {
        Call::Vertices([first, count, word(3)?, instances])
    })
}

/// Checks a draw's numbers by themselves.
pub(crate) fn check(call: &Call, facts: &Facts, faults: &mut Faults) {
    let (numbers, id) = match call {
        Call::Vertices(numbers) => (numbers, "VUID-VkDrawIndirectCommand-firstInstance-00501"),
        Call::Indices(numbers, _) => (numbers, "VUID-VkDrawIndexedIndirectCommand-firstInstance-00554"),
        Call::Indirect(_) => return,
    };
    let first_instance = numbers[2];
    if first_instance != 0 && !facts.has_first_instance {
        faults.error(
            id,
            format!(
                "firstInstance in the indirect buffer is {first_instance}, but the feature drawIndirectFirstInstance is not \
                 enabled"
            ),
        );
    }
}

/// Warns if none of a command's draws has an instance. The device writes such numbers for what it culls.
pub(crate) fn check_all(calls: &[Call], reader: &dyn Reader, faults: &mut Faults) {
    let has_no_instance = |call: &Call| match call {
        Call::Vertices([_, count, _, instances]) | Call::Indices([_, count, _, instances], _) => {
            *count > 0 && *instances == 0
        }
        Call::Indirect(_) => false,
    };
    if !reader.is_late() && !calls.is_empty() && calls.iter().all(has_no_instance) {
        faults.warning(
            "GAURAST-Draw-indirect-instances",
            "instanceCount in the indirect buffer is 0: nothing is drawn. Gaussians are vertices of one instance",
        );
    }
}
