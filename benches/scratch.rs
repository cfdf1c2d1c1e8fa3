mod works;
use calibench::measure::selection::*;
fn main(){
 let model=works::model(); let (rows,balls)=model.pool();
 let c=Candidates::new(&rows,31,balls).unwrap();
 let exc:usize=std::env::var("EXC").ok().and_then(|s|s.parse().ok()).unwrap_or(6);
 for per in [false,true]{
 let t=std::time::Instant::now();
 let mut r=Request::new(if per {Quota::PerGroup(vec![20;4])} else {Quota::Free(80)});
 r.excursion=exc;
 r.starts=20;
 let s=select(&c,&r).unwrap();
 let dt=t.elapsed();
 let mut v:Vec<f64>=s.starts.iter().map(|s|s.o1).collect(); v.sort_by(f64::total_cmp);
 println!("{per} best {:.7} min {:.7} med {:.7} time/start {:?} moves {:?}", s.o1, v[0], v[v.len()/2], dt/20, s.starts.iter().map(|s|s.moves).collect::<Vec<_>>());
 }
}
