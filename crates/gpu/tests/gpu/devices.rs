//! Devices: what is listed, what is chosen, and the errors of those that cannot be had.

use vastlight_gpu::{DeviceChoice, Drivers, GpuError};

/// Whether there is a software adapter; says so if not.
fn has_software_adapter(drivers: &Drivers) -> bool {
    let found = drivers.adapters().iter().any(|adapter| !adapter.is_hardware());
    found || crate::common::skipped()
}

#[test]
fn without_a_driver_there_is_no_adapter_and_a_hint() {
    let drivers = Drivers::none();
    assert_eq!(drivers.adapters(), []);
    for choice in [DeviceChoice::Hardware, DeviceChoice::Any, DeviceChoice::Software, DeviceChoice::Index(0)]
    {
        let error = drivers.open(choice).expect_err("nothing to open");
        assert_eq!(error, GpuError::NoAdapter, "{choice:?}");
        assert!(error.hint().contains("--device cpu") && error.hint().contains("mesa-vulkan-drivers"));
    }
}

#[test]
fn adapters_are_listed_with_what_they_can_do_hardware_first() {
    let drivers = Drivers::load();
    if !has_software_adapter(&drivers) {
        return;
    }
    let adapters = drivers.adapters();
    assert!(adapters.is_sorted_by_key(|adapter| adapter.kind));
    for (i, adapter) in adapters.iter().enumerate() {
        assert_eq!(adapter.index as usize, i);
        assert!(!adapter.name.is_empty() && !adapter.vendor.is_empty() && !adapter.backend.is_empty());
    }
    let software = adapters.iter().find(|adapter| !adapter.is_hardware()).expect("seen above");
    assert_eq!(software.unusable, None);
    assert!(software.limits.storage_buffers >= vastlight_gpu::limits::STORAGE_BUFFERS);
}

#[test]
fn choices_open_what_they_say_or_nothing() {
    let drivers = Drivers::load();
    if !has_software_adapter(&drivers) {
        return;
    }
    let adapters = drivers.adapters();
    let device = drivers.open(DeviceChoice::Software).expect("a software adapter");
    assert!(!device.adapter().is_hardware());
    let last = adapters.len() as u32 - 1;
    assert_eq!(drivers.open(DeviceChoice::Index(last)).expect("the last").adapter().index, last);
    let beyond = drivers.open(DeviceChoice::Index(last + 1)).expect_err("beyond the last");
    assert_eq!(beyond, GpuError::NoSuchIndex { index: last + 1, count: adapters.len() });

    let hardware = adapters.iter().any(|adapter| adapter.is_hardware());
    let any = drivers.open(DeviceChoice::Any).expect("any");
    assert_eq!(any.adapter().is_hardware(), hardware);
    match drivers.open(DeviceChoice::Hardware) {
        Ok(device) => assert!(device.adapter().is_hardware()),
        Err(error) => assert!(!hardware && matches!(error, GpuError::NoSuchKind { wanted: "hardware", .. })),
    }
}

#[test]
fn an_adapter_below_what_kernels_need_is_listed_with_the_reason_and_not_opened() {
    if !has_software_adapter(&Drivers::load()) {
        return;
    }
    let drivers = Drivers::needing_workgroup_bytes(1 << 30);
    for adapter in drivers.adapters() {
        let reason = adapter.unusable.expect("no adapter has this much");
        assert!(reason.contains("bytes of workgroup memory, 1073741824 are needed"), "{reason}");
    }
    let error = drivers.open(DeviceChoice::Software).expect_err("too little");
    assert!(matches!(error, GpuError::Unusable { .. }), "{error}");
    assert!(error.to_string().contains("workgroup memory"));
}
