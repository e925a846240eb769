//! Recordings without a device, and what an executor does with them.

use crate::common::{POISON, software};
use vastlight_gpu::kernel::all;
use vastlight_gpu::primitives::reduce::{Operation, record};
use vastlight_gpu::primitives::{MAX_ELEMENTS, radix};
use vastlight_gpu::{DeviceChoice, Drivers, Executor, ExecutorConfig, GpuError, Groups, Recording};

/// An executor of its own on the software adapter.
fn own(config: ExecutorConfig) -> Option<Executor> {
    drop(software()?);
    Some(Executor::new(Drivers::load().open(DeviceChoice::Software).ok()?, config))
}

fn sum_of(values: &[u32]) -> (Recording, vastlight_gpu::Download) {
    let mut recording = Recording::new();
    let input = recording.upload("values", values);
    let sum = record(&mut recording, input, values.len() as u32, Operation::Add).expect("few");
    let sum = recording.download(sum, 1);
    (recording, sum)
}

#[test]
fn recordings_are_made_and_counted_without_a_device() {
    let mut recording = Recording::new();
    let keys = recording.buffer("keys", 1_000_000);
    let pairs = radix::Pairs { keys, payloads: None };
    radix::record(&mut recording, pairs, 1_000_000, 32).expect("fits");
    // Four passes: count, three for the prefix sums, move.
    assert_eq!(recording.dispatches(), 20);
    let names: Vec<&str> = recording.kernels().iter().map(|kernel| kernel.name).collect();
    assert_eq!(names, ["radix_count", "reduce", "scan", "radix_keys"]);
    assert_eq!(recording.check(), Ok(()));
}

#[test]
fn recordings_that_make_no_sense_are_refused_without_a_device() {
    let mut other = Recording::new();
    let foreign = other.buffer("of another recording", 8);
    let mut of_none = Recording::new();
    of_none.clear(foreign);
    assert!(matches!(of_none.check(), Err(GpuError::Rejected { .. })));

    let mut beyond = Recording::new();
    let (a, b) = (beyond.buffer("a", 4), beyond.buffer("b", 4));
    beyond.copy(a, 3, b, 2);
    assert!(matches!(beyond.check(), Err(GpuError::Rejected { .. })));
    // In bytes more than 64 bits hold.
    let mut far = Recording::new();
    let (a, b) = (far.buffer("a", 4), far.buffer("b", 4));
    far.copy(a, 1 << 62, b, 1);
    assert!(matches!(far.check(), Err(GpuError::Rejected { .. })));
    let mut long = Recording::new();
    let a = long.buffer("a", 4);
    long.download(a, (u64::MAX >> 2) + 2);
    assert!(matches!(long.check(), Err(GpuError::Rejected { .. })));

    let mut few = Recording::new();
    let a = few.buffer("a", 4);
    few.dispatch(all()[0], &[0_u32; 2], &[a], Groups::Direct(1));
    assert!(matches!(few.check(), Err(GpuError::Rejected { .. })));
    let mut short = Recording::new();
    let (a, b) = (short.buffer("a", 4), short.buffer("b", 4));
    short.dispatch(all()[0], &[0_u32; 1], &[a, b], Groups::Direct(1));
    assert!(matches!(short.check(), Err(GpuError::Rejected { .. })));
    let mut wide = Recording::new();
    let (a, b) = (wide.buffer("a", 4), wide.buffer("b", 4));
    wide.dispatch(all()[0], &[0_u32; 2], &[a, b], Groups::Direct(65_536));
    assert!(matches!(wide.check(), Err(GpuError::Limit { .. })));

    let mut many = Recording::new();
    let buffer = many.buffer("values", 8);
    let error = record(&mut many, buffer, MAX_ELEMENTS + 1, Operation::Add).expect_err("too many");
    assert!(matches!(error, GpuError::Limit { .. }), "{error}");
}

#[test]
fn copies_clears_and_downloads_take_effect_in_order() {
    let Some(mut executor) = software() else { return };
    let mut recording = Recording::new();
    let a = recording.upload("a", &[1_u32, 2, 3, 4]);
    let b = recording.buffer("b", 4);
    let before = recording.download(b, 4);
    recording.copy(a, 1, b, 3);
    let copied = recording.download(b, 4);
    // Later than the copy before, which still reads what was there.
    recording.write(a, bytemuck::cast_slice(&[9_u32, 10, 11, 12]).to_vec());
    recording.copy(a, 0, b, 1);
    let written = recording.download(b, 3);
    recording.clear(b);
    let cleared = recording.download(b, 4);
    let nothing = recording.download(b, 0);
    let results = executor.run(&recording).expect("runs");
    assert_eq!(results.words(before), [POISON; 4]);
    assert_eq!(results.words(copied), [2, 3, 4, POISON]);
    assert_eq!(results.words(written), [9, 3, 4]);
    assert_eq!(results.words(cleared), [0; 4]);
    assert!(results.words(nothing).is_empty());
}

#[test]
fn buffers_stay_between_recordings_until_they_are_released() {
    let Some(mut executor) = software() else { return };
    let stays = executor.allocate("stays", 16).expect("small");
    let mut first = Recording::new();
    let (from, to) = (first.upload("values", &[5_u32, 6, 7, 8]), first.resident("stays", stays));
    first.copy(from, 0, to, 4);
    executor.run(&first).expect("runs");
    let mut second = Recording::new();
    let from = second.resident("stays", stays);
    let read = second.download(from, 4);
    assert_eq!(executor.run(&second).expect("runs").words(read), [5, 6, 7, 8]);
    executor.release(stays);
    assert!(matches!(executor.run(&second), Err(GpuError::Rejected { .. })));
}

#[test]
fn memory_is_used_again_and_bounded() {
    let budget_bytes = 200_000;
    let Some(mut executor) = own(ExecutorConfig { budget_bytes, ..ExecutorConfig::default() }) else {
        return;
    };
    let values: Vec<u32> = (0..20_000).collect();
    let (recording, sum) = sum_of(&values);
    let mut held = 0;
    for round in 0..5 {
        let results = executor.run(&recording).expect("fits");
        assert_eq!(results.words(sum), [values.iter().sum::<u32>()]);
        assert!(executor.held_bytes() <= budget_bytes);
        assert!(round == 0 || executor.held_bytes() == held, "memory grows");
        held = executor.held_bytes();
    }
    let refused = executor.run(&sum_of(&vec![1; 60_000]).0).expect_err("too large");
    let GpuError::OutOfMemory { wanted_bytes, held_bytes, .. } = &refused else { panic!("{refused}") };
    assert!(*wanted_bytes >= 240_000 && *held_bytes <= budget_bytes);
    assert!(refused.hint().contains("--gpu-memory"));
    // Afterwards the device works as before.
    assert_eq!(executor.run(&recording).expect("fits").words(sum), [values.iter().sum::<u32>()]);
}

#[test]
fn what_cannot_be_filled_does_not_stay() {
    let budget_bytes = 40_960;
    let config = ExecutorConfig { budget_bytes, ..ExecutorConfig::default() };
    let Some(mut executor) = own(config) else { return };
    // There is room for it, but none for what filling takes.
    let full = executor.keep("full", &[7_u32; 10_240]).expect_err("all of the budget");
    assert!(matches!(full, GpuError::OutOfMemory { .. }), "{full}");
    let all_of_it = executor.allocate("all", budget_bytes).expect("nothing else stays");
    executor.release(all_of_it);
}

#[test]
fn memory_that_is_refused_is_asked_for_again_without_what_is_unused() {
    let config = ExecutorConfig { budget_bytes: 200_000, ..ExecutorConfig::default() };
    let Some(mut executor) = own(config) else { return };
    for n in [20_000, 30_000, 40_000, 20_000] {
        let (recording, sum) = sum_of(&vec![1; n as usize]);
        assert_eq!(executor.run(&recording).expect("fits alone").words(sum), [n]);
        assert!(executor.held_bytes() <= 200_000);
    }
    let error = executor.run(&sum_of(&vec![1; 60_000]).0).expect_err("refused");
    assert!(matches!(error, GpuError::OutOfMemory { .. }), "{error}");
    let (recording, sum) = sum_of(&[1, 2, 3]);
    assert_eq!(executor.run(&recording).expect("runs").words(sum), [6]);
}

#[test]
fn more_than_the_device_allows_is_an_error_and_not_a_crash() {
    let Some(mut executor) = own(ExecutorConfig::default()) else { return };
    for bytes in [u64::MAX, u64::MAX / 2] {
        let error = executor.allocate("huge", bytes).expect_err("too large");
        assert!(matches!(error, GpuError::Limit { .. }), "{error}");
    }
    let binding = executor.adapter().limits.binding_bytes;
    let mut wide = Recording::new();
    let values = wide.buffer("values", binding / 4 + 1);
    record(&mut wide, values, 1, Operation::Add).expect("few");
    let error = executor.run(&wide).expect_err("more than a kernel sees");
    assert!(matches!(error, GpuError::Limit { limit, .. } if limit == binding), "{error}");
    let most = executor.adapter().limits.buffer_bytes;
    let mut held = Vec::new();
    // Memory is promised, not touched: what a driver refuses at last is an error too.
    let refused = (0..4).find_map(|_| match executor.allocate("large", most) {
        Ok(resident) => {
            held.push(resident);
            None
        }
        Err(error) => Some(error),
    });
    if let Some(error) = refused {
        assert!(matches!(error, GpuError::OutOfMemory { .. } | GpuError::Limit { .. }), "{error}");
    }
    held.into_iter().for_each(|resident| executor.release(resident));
    let (recording, sum) = sum_of(&[1, 2, 3]);
    assert_eq!(executor.run(&recording).expect("runs").words(sum), [6]);
}

#[test]
fn a_lost_device_is_an_error_of_all_further_work() {
    let Some(mut executor) = own(ExecutorConfig::default()) else { return };
    let (recording, sum) = sum_of(&[1, 2, 3]);
    assert_eq!(executor.run(&recording).expect("runs").words(sum), [6]);
    executor.device().lose();
    for _ in 0..2 {
        let error = executor.run(&recording).expect_err("lost");
        assert!(matches!(error, GpuError::Lost { .. }), "{error}");
        assert!(error.hint().contains("--device cpu"));
    }
    assert!(matches!(executor.allocate("more", 64), Err(GpuError::Lost { .. })));
}

#[test]
fn compiling_tells_how_far_it_is() {
    let Some(mut executor) = own(ExecutorConfig::default()) else { return };
    let kernels = vastlight_gpu::kernel::all();
    let mut told = Vec::new();
    executor.prepare(&kernels[..3], &mut |progress| told.push(progress)).expect("compiles");
    let counts: Vec<(usize, usize)> = told.iter().map(|p| (p.done, p.total)).collect();
    assert_eq!(counts, [(1, 3), (2, 3), (3, 3)]);
    assert!(told.iter().all(|progress| progress.ms > 0.0));
    told.clear();
    executor.prepare(&kernels[..3], &mut |progress| told.push(progress)).expect("ready");
    assert!(told.iter().all(|progress| progress.ms == 0.0));
}

#[test]
fn portions_do_not_change_the_answer() {
    let values: Vec<u32> = (0..100_000_u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
    let expected = values.iter().fold(0_u32, |sum, value| sum.wrapping_add(*value));
    for groups_per_submission in [1, 7, u32::MAX] {
        let config = ExecutorConfig { groups_per_submission, ..ExecutorConfig::default() };
        let Some(mut executor) = own(config) else { return };
        let (recording, sum) = sum_of(&values);
        assert_eq!(executor.run(&recording).expect("runs").words(sum), [expected]);
    }
}

#[test]
fn buffers_of_one_recording_make_room_for_each_other() {
    // Three sizes, of which the budget holds two: the first is unused when the third comes.
    let config = ExecutorConfig { budget_bytes: 300_000, ..ExecutorConfig::default() };
    let Some(mut executor) = own(config) else { return };
    let mut recording = Recording::new();
    let values: Vec<u32> = (0..25_000).collect();
    let first = recording.upload("first", &values);
    let second = recording.buffer("second", 31_000);
    recording.copy(first, 0, second, 25_000);
    let third = recording.buffer("third", 37_000);
    recording.copy(second, 0, third, 25_000);
    let end = recording.download(third, 25_000);
    for _ in 0..2 {
        let results = executor.run(&recording).expect("two fit at a time");
        assert!(results.words(end) == values);
        assert!(executor.held_bytes() <= 300_000);
    }
}
