use slicestack::{Settings, scene::*, study::*};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    if a[1] == "s" {
        let s = stability(&Settings::default()).unwrap();
        for r in &s.rows {
            if !r.holds || a.len() > 2 {
                println!("{} {:20} {:60} | {} | {}", if r.holds { "ok " } else { "NOT" }, r.group, r.case, r.promise, r.measured);
            }
        }
        println!(
            "{} rows, {} broken, {:.1} s; neg {:?} div {:?}",
            s.rows.len(),
            s.broken().count(),
            s.seconds,
            s.negative_from,
            s.divergent_from
        );
        return;
    }
    let f = SceneFile::read(std::path::Path::new(&a[1]), &Overrides::default()).unwrap();
    let v = f.volume().load(&Settings::default().limits).unwrap();
    let (s, _) = f.to_scene(&v).unwrap();
    let st = study(&v, &s, &Options { budget: a[2].parse().unwrap(), ..Options::default() }).unwrap();
    let r = st.record;
    println!("{:?}", r.setting);
    for p in &r.points {
        println!(
            "{:26} {:7} {:?} {:8.2} ms prep {:8.2} ms x{} rms {:.2e} max {:.2e} vis {:.3} ssim {:?} flip {:?} chg {:?}",
            p.method,
            p.slices,
            p.tolerance,
            p.seconds * 1e3,
            p.prepare_seconds * 1e3,
            p.repeats,
            p.rms,
            p.max,
            p.visible,
            p.ssim,
            p.flip,
            p.change
        );
    }
    for m in &r.methods {
        println!("{:26} {:?} {:?} {:?}", m.name, m.expected_order, m.measured_order, m.missing);
    }
    for p in &r.stages {
        println!("{:20} {:20} {:.3} ms {:.1} % {}", p.method, p.stage, p.seconds * 1e3, p.share * 100.0, p.batches);
    }
    for p in &r.costs {
        println!("{p:?}");
    }
    for p in &r.advice {
        println!("{p:?}");
    }
    println!("{:?}", r.pre_integration);
}
