//! scratch
#![allow(clippy::print_stdout)]
use cutis_gpu::*;
fn main() {
    let gpu = Gpu::open(&GpuOptions::default()).unwrap();
    let n = 100000usize;
    let mut s = 12345u32;
    let mut r = move || { s ^= s << 13; s ^= s >> 17; s ^= s << 5; (s as f32 / 4.2949673e9) * 2.0 - 1.0 };
    let a: Vec<f32> = (0..4*n).map(|_| r()).collect();
    let ops: [(&str, fn(f32,f32,f32,f32)->f32); 12] = [
        ("x / y", |x,y,_,_| x/y),
        ("1.0 / y", |_,y,_,_| 1.0/y),
        ("sqrt(abs(x))", |x,_,_,_| x.abs().sqrt()),
        ("1.0 / sqrt(abs(x))", |x,_,_,_| 1.0/x.abs().sqrt()),
        ("x * y + z", |x,y,z,_| x*y+z),
        ("x * y + z * w", |x,y,z,w| x*y+z*w),
        ("x * y - z * w", |x,y,z,w| x*y-z*w),
        ("-(x * y) / z", |x,y,z,_| -(x*y)/z),
        ("dot(vec3f(x,y,z), vec3f(y,z,w))", |x,y,z,w| x*y+y*z+z*w),
        ("select(x / y, 0.0, y == 0.0) * z", |x,y,z,_| x/y*z),
        ("x / (y + 2.0)", |x,y,_,_| x/(y+2.0)),
        ("(x * z) * (w * y)", |x,y,z,w| (x*z)*(w*y)),
    ];
    let input = gpu.buffer("in", &a).unwrap();
    let out = gpu.zeroed::<f32>("out", n).unwrap();
    for (text, f) in ops {
        let src = format!("@group(0) @binding(0) var<storage, read> a: array<vec4f>; @group(0) @binding(1) var<storage, read_write> o: array<f32>; @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {{ let k = id.x; if (k >= arrayLength(&a)) {{ return; }} let x = a[k].x; let y = a[k].y; let z = a[k].z; let w = a[k].w; o[k] = {text}; }}");
        let k = gpu.kernel("k", &src, "main").unwrap();
        let g = gpu.bind(&k, 0, &[(0, input.whole()), (1, out.whole())]).unwrap();
        let mut p = gpu.pass("p"); p.dispatch(&k, &[&g], n); p.submit().unwrap();
        let got = gpu.read(&out, 0..n).unwrap();
        let bad = (0..n).filter(|&k| got[k].to_bits() != f(a[4*k],a[4*k+1],a[4*k+2],a[4*k+3]).to_bits()).count();
        println!("{text}: {bad} of {n}");
    }
}
