//! Every kernel without a device: valid WGSL, written by every back end, within WebGPU's limits, structs as in Rust.

use crate::lights::LIGHTS_PROBE;
use crate::maths::MATH_PROBE;
use crate::photon::PHOTON_PROBE;
use crate::scattering::BSDF_PROBE;
use naga::back::{glsl, hlsl, msl, spv};
use naga::proc::BoundsCheckPolicies;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Module, TypeInner};
use std::collections::BTreeSet;
use std::path::Path;
use vastlight_gpu::kernel::{Kernel, StructLayout, all};
use vastlight_gpu::primitives::{GROUP, TILE, bitonic, histogram};
use vastlight_gpu::{limits, trace};

fn parse(wgsl: &str) -> Result<(Module, ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
    let info = info.map_err(|e| e.emit_to_string(wgsl))?;
    Ok((module, info))
}

/// A kernel with its module.
type Parsed = (&'static Kernel, Module, ModuleInfo);

fn parsed(kernel: &'static Kernel) -> Parsed {
    let (module, info) = parse(&kernel.wgsl()).unwrap_or_else(|e| panic!("{}: {e}", kernel.name));
    (kernel, module, info)
}

/// The kernels with their modules; there are some.
fn kernels() -> Vec<Parsed> {
    let parsed: Vec<_> = all().into_iter().map(parsed).collect();
    assert!(parsed.len() >= 13);
    parsed
}

#[test]
fn every_file_is_a_kernel_and_every_kernel_is_valid() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/wgsl");
    let files = std::fs::read_dir(folder).expect("the folder of kernels");
    let files = files.filter_map(|file| Some(file.expect("a file").file_name().to_str()?.to_owned()));
    let files: BTreeSet<String> =
        files.filter_map(|name| Some(name.strip_suffix(".wgsl")?.to_owned())).collect();
    let names: BTreeSet<String> = kernels().iter().map(|(kernel, ..)| kernel.name.to_owned()).collect();
    assert_eq!(files, names);
}

#[test]
fn what_is_not_valid_is_found() {
    let good = all()[0].wgsl();
    assert!(parse(&good).is_ok());
    for (from, to) in [("values[i]", "values[i] + 1.0"), ("var<uniform>", "var<nothing>"), ("}", "")] {
        assert!(parse(&good.replacen(from, to, 1)).is_err(), "{from} as {to}");
    }
}

#[test]
fn shared_parts_are_put_in_once_and_none_is_missing() {
    for kernel in all() {
        assert!(!kernel.wgsl().contains("#include"), "{}: a part that does not exist", kernel.name);
    }
    let parameters = all()[0].parameters;
    let source = "//#include group_scan\n//#include group\n//#include nothing_of_that_name\nfn f() {}";
    let text = Kernel { name: "f", source, parameters, buffers: 0 }.wgsl();
    assert_eq!(text.matches("const GROUP:").count(), 1);
    assert_eq!(text.matches("fn group_scan(").count(), 1);
    assert!(text.ends_with("//#include nothing_of_that_name\nfn f() {}\n"));
}

#[test]
fn numbers_that_both_sides_know_are_the_same() {
    for (kernel, line) in [
        ("reduce", format!("const GROUP: u32 = {GROUP}u;")),
        ("reduce", format!("const ITEMS: u32 = {}u;", TILE / GROUP)),
        ("bitonic", format!("const LONGEST: u32 = {}u;", bitonic::LONGEST)),
        ("histogram", format!("const MAX_BINS: u32 = {}u;", 1 << histogram::MAX_BITS)),
        ("closest", format!("const STACK: u32 = {}u;", trace::STACK)),
    ] {
        let kernel = all().into_iter().find(|k| k.name == kernel).expect("a kernel");
        assert!(kernel.wgsl().contains(&line), "{}: {line}", kernel.name);
    }
}

fn written<T, E: std::fmt::Debug>(outcome: Result<T, E>, kernel: &str, back_end: &str) -> T {
    outcome.unwrap_or_else(|e| panic!("{kernel} for {back_end}: {e:?}"))
}

#[test]
fn every_back_end_writes_every_kernel() {
    // Probes as well: they hold parts that kernels share.
    let probes = [&MATH_PROBE, &LIGHTS_PROBE, &BSDF_PROBE, &PHOTON_PROBE].map(parsed);
    for (kernel, module, info) in kernels().into_iter().chain(probes) {
        let name = kernel.name;
        let words = spv::write_vec(&module, &info, &spv::Options::default(), None);
        assert!(written(words, name, "SPIR-V").len() > 50);

        // Reversed bits need Metal 2.1, of 2018.
        let options = msl::Options { lang_version: (2, 1), ..msl::Options::default() };
        let text = msl::write_string(&module, &info, &options, &msl::PipelineOptions::default());
        assert!(written(text, name, "Metal").0.contains("kernel void"));

        let (mut text, options) = (String::new(), hlsl::Options::default());
        let pipeline = hlsl::PipelineOptions::default();
        let done = hlsl::Writer::new(&mut text, &options, &pipeline).write(&module, &info, None);
        written(done, name, "HLSL");
        assert!(text.contains("numthreads"));

        let (mut text, options) = (String::new(), glsl::Options::default());
        let options =
            glsl::Options { version: glsl::Version::Embedded { version: 310, is_webgl: false }, ..options };
        let pipeline = glsl::PipelineOptions {
            shader_stage: naga::ShaderStage::Compute,
            entry_point: "main".into(),
            multiview: None,
        };
        let policies = BoundsCheckPolicies::default();
        let writer = glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, policies);
        written(written(writer, name, "GLSL").write(), name, "GLSL");
        assert!(text.contains("local_size_x"));
    }
}

#[test]
fn every_kernel_stays_within_what_webgpu_promises() {
    for (kernel, module, _) in kernels() {
        let [entry] = &module.entry_points[..] else { panic!("{}: one entry point", kernel.name) };
        assert_eq!(entry.name, "main", "{}", kernel.name);
        let invocations: u32 = entry.workgroup_size.iter().product();
        assert!(invocations <= limits::WORKGROUP_INVOCATIONS, "{}: {invocations}", kernel.name);
        let shared = workgroup_bytes(&module);
        assert!(shared <= limits::WORKGROUP_BYTES, "{}: {shared} bytes", kernel.name);
        assert!(kernel.buffers <= limits::STORAGE_BUFFERS as usize, "{}", kernel.name);
    }
}

fn workgroup_bytes(module: &Module) -> u32 {
    let shared = module.global_variables.iter().filter(|(_, v)| v.space == AddressSpace::WorkGroup);
    shared.map(|(_, v)| module.types[v.ty].inner.size(module.to_ctx()).next_multiple_of(16)).sum()
}

#[test]
fn bindings_are_those_that_are_declared_and_all_are_used() {
    for (kernel, module, info) in kernels() {
        let entry = info.get_entry_point(0);
        let mut bindings = Vec::new();
        for (handle, variable) in module.global_variables.iter() {
            let Some(binding) = &variable.binding else { continue };
            assert!(!entry[handle].is_empty(), "{}: binding {} is not used", kernel.name, binding.binding);
            assert_eq!(binding.group, 0, "{}", kernel.name);
            let uniform = variable.space == AddressSpace::Uniform;
            assert_eq!(uniform, binding.binding == 0, "{}: binding {}", kernel.name, binding.binding);
            bindings.push(binding.binding as usize);
        }
        bindings.sort_unstable();
        assert_eq!(bindings, (0..=kernel.buffers).collect::<Vec<_>>(), "{}", kernel.name);
    }
}

/// Whether naga lays a struct out as Rust does.
fn same_layout(module: &Module, layout: &StructLayout) -> bool {
    let mut found = module.types.iter().filter(|(_, t)| t.name.as_deref() == Some(layout.name));
    let Some((_, found)) = found.next() else { return false };
    let TypeInner::Struct { members, span } = &found.inner else { return false };
    let fields = members.iter().map(|m| {
        let bytes = module.types[m.ty].inner.size(module.to_ctx());
        (m.name.as_deref().unwrap_or_default(), m.offset as usize, bytes as usize)
    });
    *span as usize == layout.bytes && fields.eq(layout.fields.iter().copied())
}

#[test]
fn structs_lie_in_memory_as_in_rust() {
    for (kernel, module, _) in kernels() {
        assert!(same_layout(&module, kernel.parameters), "{}: {:?}", kernel.name, kernel.parameters);
    }
}

#[test]
fn a_struct_that_differs_is_found() {
    let reduce = all()[0];
    let text = reduce.wgsl();
    for (from, to) in [
        ("    count: u32,\n    operation: u32,", "    operation: u32,\n    count: u32,"),
        ("operation: u32,", "operation: u32,\n more: u32,"),
        ("operation: u32,", "@align(16) operation: u32,"),
        ("struct Parameters", "alias Other = Parameters; struct Parameters"),
    ] {
        let (module, _) = parse(&text.replacen(from, to, 1)).expect("valid all the same");
        assert_eq!(same_layout(&module, reduce.parameters), from.starts_with("struct"), "{to}");
    }
}
