//! Tests of failing host allocations. Injection affects the whole process, so this file has one test.

use devmem::Allocation;
use devmem::host::*;
use std::panic::catch_unwind;

#[test]
fn what_has_no_memory_unwinds_to_where_it_is_caught() {
    let all = || {
        let mut items = with_capacity(3);
        resize(&mut items, 5, 1u32);
        push(&mut items, 2);
        let zeros: Vec<u64> = zeroed(10);
        (items, zeros.len(), copied(&[3u8, 4]), collect(0..3u8), filled('x', 2))
    };
    let expected = (vec![1, 1, 1, 1, 1, 2], 10, vec![3, 4], vec![0, 1, 2], vec!['x', 'x']);
    assert_eq!(catch(all), Ok(expected.clone()));
    let mut failed = 0;
    loop {
        injection::fail(failed);
        let outcome = catch(all);
        if injection::stop().is_some() {
            assert_eq!(outcome, Ok(expected));
            break;
        }
        assert!(outcome.is_err(), "{failed}");
        failed += 1;
    }
    assert!(failed >= 6, "{failed}");
    assert!(zeroed::<u32>(0).is_empty());
    assert_eq!(zeroed::<()>(7).len(), 7);
    let huge = catch(|| zeroed::<u64>(usize::MAX / 4));
    assert!(huge.is_err());
    let huge = catch(|| with_capacity::<u64>(1 << 60));
    assert_eq!(huge, Err(OutOfMemory { bytes: 1 << 63 }));
    let other = catch_unwind(|| catch(|| panic!("another")));
    assert!(other.is_err(), "other panics go on");
    injection::fail(0);
    assert!(Allocation::new_zeroed(16).is_err());
    assert_eq!(injection::stop(), None);
    assert!(Allocation::new_zeroed(16).is_ok());
}
