use sinew::{measurement::Recording, parameters::Parameters, simulation::replay};
fn main(){ for f in std::env::args().skip(1) { let r=Recording::read(std::path::Path::new(&f),&[]).unwrap();
 for set in ["", "force_gain.relative_error=0.05","end_effects.excess=0.05","force_sensor_offset.offset=10","friction_hysteresis.half_width=20","creep.amplitude_1=0.1","valve_dead_time.delay=0.03","valve_dead_band.stiction=0.05"]{ let mut p=Parameters::default(); if let Some((n,v))=set.split_once('='){ p.set(n,v.parse().unwrap()).unwrap(); }
 let t=std::time::Instant::now(); for _ in 0..10{ std::hint::black_box(replay(&p,&r).unwrap()); } println!("{set} {:?} per replay, {:.3} us per sample",t.elapsed()/10,t.elapsed().as_secs_f64()*1e5/r.time.len() as f64); } } }
