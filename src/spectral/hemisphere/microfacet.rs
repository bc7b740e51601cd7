//! Directional albedos of single scattering by microfacets: what a rough surface sends back after one scattering event,
//! and what is missing from 1 because it would be scattered again.
//!
//! GGX (Walter et al. 2007) with visible normals, Smith's masking: correlated by height for reflection (Heitz 2014,
//! eq. 99), and G1 G1 for refraction (Walter et al. 2007, eq. 23), where the two directions leave on opposite sides and
//! correlation by height would be wrong. The integrals go over the square that visible normals are made from (Dupuy and
//! Benyoub 2023): E = ∫∫ F G2/G1 du dv, whose integrand is bounded by 1 at every roughness.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::{Arc, LazyLock};

use glam::{DVec2, DVec3};
use quick_cache::sync::Cache;
use rayon::prelude::*;

use super::{fresnel, recent};

/// Nodes along the cosine, and around the normal over a quarter turn.
const COSINES: usize = 128;
const AZIMUTHS: usize = 33;
/// Points of the lattice for a node of a table, and its generator: two Fibonacci numbers. Off by at most
/// 4e-5 (measured for α from 0.001 to 1 and indices of 1.33 and 1.5).
pub(super) const LATTICE: (usize, usize) = (4_181, 2_584);
/// The same where some of what is seen is totally reflected, an edge in the integrand: off by up to 5e-4.
const LATTICE_OF_DENSER: (usize, usize) = (10_946, 6_765);
/// At least four times the points of a table's node, and no common factor with them.
#[cfg(test)]
pub(super) const FINE: (usize, usize) = (46_368, 28_657);
/// Largest step of a table along ln η.
const INDEX_STEP: f64 = 0.02;
/// Tables of a kind that are kept: 34 KiB each, of dielectrics 4 KiB for each step of the index.
const RECENT_TABLES: usize = 256;

/// 1 - E for a surface of GGX roughness α that reflects everything: the flux that single scattering loses.
///
/// Table over cosine and azimuth. E is within 1e-4 where isotropic, and within 2e-4 for ratios of the two α up to 10
/// (measured: 7.5e-4 at a ratio of 100).
pub struct ReflectionAlbedo {
    alpha: [f64; 2],
    /// \[azimuth\]\[cosine\]; one azimuth if isotropic.
    loss: Vec<[f64; COSINES]>,
    mean_loss: f64,
}

impl ReflectionAlbedo {
    /// [`Self::new`], or what it has lately given for the same roughness.
    pub fn shared(alpha: [f64; 2]) -> Arc<Self> {
        static RECENT: LazyLock<Cache<[u64; 2], Arc<ReflectionAlbedo>>> = LazyLock::new(|| Cache::new(RECENT_TABLES));
        recent(&RECENT, alpha.map(f64::to_bits), || Self::new(alpha))
    }

    /// `alpha`: along x and along y, both above 0.
    pub fn new(alpha: [f64; 2]) -> Self {
        let rows = if alpha[0] == alpha[1] { 1 } else { AZIMUTHS };
        let mut albedo = ReflectionAlbedo { alpha, loss: Vec::new(), mean_loss: 0.0 };
        let lattice = Lattice::new(LATTICE);
        let of_row = |row: usize| {
            let (sin, cos) = azimuth_at(row, alpha, AZIMUTHS).sin_cos();
            let (towards, effective) = (DVec3::new(cos, sin, 0.0), (alpha[0] * cos).hypot(alpha[1] * sin));
            std::array::from_fn(|i| {
                let z = cosine_at(i, effective);
                1.0 - reflection(alpha, (1.0 - z * z).max(0.0).sqrt() * towards + z * DVec3::Z, &lattice)
            })
        };
        albedo.loss = (0..rows).into_par_iter().map(of_row).collect();
        // (1/π) ∫ loss cosθ dω, by the midpoints of z² and azimuth.
        const STEPS: usize = 512;
        let midpoint = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let turns = if rows == 1 { 1 } else { STEPS };
        let sum: f64 = (0..turns)
            .flat_map(|j| (0..STEPS).map(move |i| (i, j)))
            .map(|(i, j)| {
                let z2 = midpoint(i, STEPS);
                let (sin, cos) = (FRAC_PI_2 * midpoint(j, turns)).sin_cos();
                let r = (1.0 - z2).sqrt();
                albedo.loss(DVec3::new(r * cos, r * sin, z2.sqrt()))
            })
            .sum();
        albedo.mean_loss = sum / (turns * STEPS) as f64;
        albedo
    }

    /// 1 - E for a direction with z in [0, 1].
    pub fn loss(&self, direction: DVec3) -> f64 {
        let across = direction.x.hypot(direction.y);
        if self.loss.len() == 1 || across == 0.0 {
            return between(&self.loss[0], position(direction.z, self.alpha[0]));
        }
        let (x, y) = (direction.x.abs() / across, direction.y.abs() / across);
        let at = position(direction.z, (self.alpha[0] * x).hypot(self.alpha[1] * y));
        let turn = turn(y.atan2(x), self.alpha, AZIMUTHS);
        let row = (turn as usize).min(self.loss.len() - 2);
        let (a, b) = (between(&self.loss[row], at), between(&self.loss[row + 1], at));
        a + (turn - row as f64) * (b - a)
    }

    /// The hemispherical mean (1/π) ∫ loss cosθ dω.
    pub fn mean_loss(&self) -> f64 {
        self.mean_loss
    }

    /// The losses themselves, \[azimuth\]\[cosine\]: one azimuth where isotropic, else equal steps of half the sum of the
    /// azimuth and that in the space in which the distribution is round.
    pub fn rows(&self) -> &[[f64; COSINES]] {
        &self.loss
    }
}

/// Albedos of single scattering by a rough boundary between two dielectrics, seen from before and from behind it.
///
/// Tables over cosine and ln η. The loss is within 6e-4 on the denser side, 1e-4 on the other; reflection within 3e-4 on
/// the rarer side for α of at least 0.02. On the denser side the table smears the edge of total reflection of a surface
/// less rough than its nodes are apart, where reflection alone may be wrong by 0.3; the loss is not.
pub struct DielectricAlbedo {
    alpha: f64,
    /// Before and behind; η is the index behind over that before.
    sides: ByIndex<[SideAlbedo; 2]>,
}

#[derive(Clone)]
struct SideAlbedo {
    reflected: [f64; COSINES],
    loss: [f64; COSINES],
    mean_reflected: f64,
    mean_loss: f64,
}

/// What the index of a boundary decides, at equal steps of ln η.
struct ByIndex<T> {
    first: f64,
    step: f64,
    nodes: Vec<T>,
}

impl<T: Send> ByIndex<T> {
    fn new(range: [f64; 2], of_index: impl Fn(f64) -> T + Sync) -> Self {
        let [first, last] = range.map(f64::ln);
        let steps = ((last - first) / INDEX_STEP).ceil().max(0.0) as usize;
        let step = (last - first) / steps.max(1) as f64;
        let node = |i: usize| of_index((first + i as f64 * step).exp());
        ByIndex { first, step, nodes: (0..=steps).into_par_iter().map(node).collect() }
    }

    fn blend(&self, eta: f64, value: impl Fn(&T) -> f64) -> f64 {
        if self.nodes.len() == 1 {
            return value(&self.nodes[0]);
        }
        let x = ((eta.ln() - self.first) / self.step).clamp(0.0, (self.nodes.len() - 1) as f64);
        let i = (x as usize).min(self.nodes.len() - 2);
        let [a, b] = [i, i + 1].map(|i| value(&self.nodes[i]));
        a + (x - i as f64) * (b - a)
    }

    /// As devices read it.
    fn table<'a>(&'a self, columns: impl Fn(&'a T) -> [&'a [f64; COSINES]; 4]) -> IndexTable<'a> {
        IndexTable { first: self.first, step: self.step, columns: self.nodes.iter().map(columns).collect() }
    }
}

/// Tables over ln η, from `first` on in steps, and cosine: for each index what is reflected and lost before, and behind.
pub struct IndexTable<'a> {
    pub first: f64,
    pub step: f64,
    pub columns: Vec<[&'a [f64; COSINES]; 4]>,
}

impl DielectricAlbedo {
    /// [`Self::new`], or what it has lately given for the same boundary.
    pub fn shared(alpha: f64, range: [f64; 2]) -> Arc<Self> {
        static RECENT: LazyLock<Cache<[u64; 3], Arc<DielectricAlbedo>>> = LazyLock::new(|| Cache::new(RECENT_TABLES));
        recent(&RECENT, [alpha, range[0], range[1]].map(f64::to_bits), || Self::new(alpha, range))
    }

    /// For η within `range` and isotropic roughness `alpha` above 0.
    pub fn new(alpha: f64, range: [f64; 2]) -> Self {
        let (lattice, of_denser) = (Lattice::new(LATTICE), Lattice::new(LATTICE_OF_DENSER));
        let side = |eta: f64| SideAlbedo::new(alpha, eta, if eta < 1.0 { &of_denser } else { &lattice });
        DielectricAlbedo { alpha, sides: ByIndex::new(range, |eta| [eta, eta.recip()].map(side)) }
    }

    fn blend(&self, eta: f64, behind: bool, value: impl Fn(&SideAlbedo) -> f64) -> f64 {
        self.sides.blend(eta, |sides| value(&sides[usize::from(behind)]))
    }

    /// The tables themselves.
    pub fn table(&self) -> IndexTable<'_> {
        self.sides.table(|[a, b]| [&a.reflected, &a.loss, &b.reflected, &b.loss])
    }

    /// Flux reflected by one scattering event, for an observer `behind` the boundary or before it at cosine `z`.
    pub fn reflected(&self, eta: f64, behind: bool, z: f64) -> f64 {
        let at = position(z, self.alpha);
        self.blend(eta, behind, |side| between(&side.reflected, at))
    }

    /// Flux neither reflected nor transmitted by one scattering event.
    pub fn loss(&self, eta: f64, behind: bool, z: f64) -> f64 {
        let at = position(z, self.alpha);
        self.blend(eta, behind, |side| between(&side.loss, at))
    }

    /// Hemispherical mean of [`Self::reflected`].
    pub fn mean_reflected(&self, eta: f64, behind: bool) -> f64 {
        self.blend(eta, behind, |side| side.mean_reflected)
    }

    /// Hemispherical mean of [`Self::loss`].
    pub fn mean_loss(&self, eta: f64, behind: bool) -> f64 {
        self.blend(eta, behind, |side| side.mean_loss)
    }
}

impl SideAlbedo {
    /// `eta`: the index on the far side over that on this side.
    fn new(alpha: f64, eta: f64, lattice: &Lattice) -> Self {
        let albedos = boundaries(alpha, eta, lattice);
        let (reflected, loss) = (albedos.map(|albedo| albedo.x), albedos.map(|albedo| 1.0 - albedo.x - albedo.y));
        let (mean_reflected, mean_loss) = (mean(&reflected, alpha), mean(&loss, alpha));
        SideAlbedo { reflected, loss, mean_reflected, mean_loss }
    }
}

/// What a rough coat reflects by one scattering event, seen from outside, where nothing is reflected totally: to 3e-4 for α of at
/// least 0.02.
pub struct CoatAlbedo {
    alpha: f64,
    /// By cosine, and the hemispherical mean.
    reflected: ByIndex<([f64; COSINES], f64)>,
}

impl CoatAlbedo {
    /// For an index within `range`, of at least 1, and isotropic roughness `alpha` above 0; kept for the next who asks.
    pub fn shared(alpha: f64, range: [f64; 2]) -> Arc<Self> {
        static RECENT: LazyLock<Cache<[u64; 3], Arc<CoatAlbedo>>> = LazyLock::new(|| Cache::new(RECENT_TABLES));
        recent(&RECENT, [alpha, range[0], range[1]].map(f64::to_bits), || Self::new(alpha, range))
    }

    /// As [`CoatAlbedo::shared`].
    pub fn new(alpha: f64, range: [f64; 2]) -> Self {
        let lattice = Lattice::new(LATTICE);
        let of_index = |eta: f64| {
            let reflected = boundaries(alpha, eta, &lattice).map(|albedo| albedo.x);
            (reflected, mean(&reflected, alpha))
        };
        CoatAlbedo { alpha, reflected: ByIndex::new(range, of_index) }
    }

    /// At cosine `z`.
    pub fn reflected(&self, eta: f64, z: f64) -> f64 {
        let at = position(z, self.alpha);
        self.reflected.blend(eta, |(reflected, _)| between(reflected, at))
    }

    /// Hemispherical mean of [`Self::reflected`].
    pub fn mean_reflected(&self, eta: f64) -> f64 {
        self.reflected.blend(eta, |(_, mean)| *mean)
    }

    /// The table itself; what nobody asks a coat for is 0.
    pub fn table(&self) -> IndexTable<'_> {
        const NOTHING: &[f64; COSINES] = &[0.0; COSINES];
        self.reflected.table(|(reflected, _)| [reflected, NOTHING, NOTHING, NOTHING])
    }
}

/// Position of an azimuth from 0 to π/2 among the nodes: half of it the azimuth, half that in the space in which the
/// distribution is round.
pub(super) fn turn(azimuth: f64, alpha: [f64; 2], rows: usize) -> f64 {
    let (sin, cos) = azimuth.sin_cos();
    (rows - 1) as f64 * 0.5 * (azimuth + (alpha[1] * sin).atan2(alpha[0] * cos)) / FRAC_PI_2
}

/// The azimuth at node `row`, by bisection of [`turn`].
pub(super) fn azimuth_at(row: usize, alpha: [f64; 2], rows: usize) -> f64 {
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if turn(middle, alpha, rows) < row as f64 { low = middle } else { high = middle }
    }
    if row == 0 { 0.0 } else { high }
}

/// Position of cosine `z` among the nodes. Half of t is z, half z (1 + α) / (z + α), since masking sets in where the slope
/// of the direction is that of the surface; and the position is √t, since albedos are steepest towards grazing.
fn position(z: f64, alpha: f64) -> f64 {
    (COSINES - 1) as f64 * (0.5 * (z + z * (1.0 + alpha) / (z + alpha))).sqrt()
}

/// The cosine at node `i`: the positive root of position(z) = i.
pub(super) fn cosine_at(i: usize, alpha: f64) -> f64 {
    let root_t = i as f64 / (COSINES - 1) as f64;
    let t = 2.0 * root_t * root_t;
    let b = 1.0 + 2.0 * alpha - t;
    // z² + b z - t α = 0
    let root = (b * b + 4.0 * t * alpha).sqrt();
    let z = if b >= 0.0 { 2.0 * t * alpha / (b + root) } else { 0.5 * (root - b) };
    z.clamp(0.0, 1.0)
}

fn between(nodes: &[f64; COSINES], at: f64) -> f64 {
    let i = (at as usize).min(COSINES - 2);
    nodes[i] + (at - i as f64) * (nodes[i + 1] - nodes[i])
}

/// ∫ f(z) 2z dz of what [`between`] makes of a table.
fn mean(nodes: &[f64; COSINES], alpha: f64) -> f64 {
    const STEPS: usize = 2048;
    let z = |i: usize| ((i as f64 + 0.5) / STEPS as f64).sqrt();
    (0..STEPS).map(|i| between(nodes, position(z(i), alpha))).sum::<f64>() / STEPS as f64
}

/// Smith's Λ: G1 = 1/(1 + Λ).
pub(super) fn lambda(alpha: [f64; 2], v: DVec3) -> f64 {
    let slope2 = ((alpha[0] * v.x).powi(2) + (alpha[1] * v.y).powi(2)) / (v.z * v.z);
    if slope2.is_finite() { 0.5 * slope2 / (1.0 + (1.0 + slope2).sqrt()) } else { f64::INFINITY }
}

/// E of a surface that reflects everything: the mean over visible normals of G2/G1.
fn reflection(alpha: [f64; 2], o: DVec3, lattice: &Lattice) -> f64 {
    let lambda_o = lambda(alpha, o);
    let reflected = |h: DVec3| {
        let i = 2.0 * o.dot(h) * h - o;
        if i.z <= 0.0 { 0.0 } else { smith_ratio(lambda_o, lambda(alpha, i)) }
    };
    lattice.mean(alpha, o, |h| DVec2::new(reflected(h), 0.0)).x
}

/// Reflected and transmitted flux, for an observer on this side of a boundary of relative index `eta`: means over visible
/// normals of F G2/G1 and of (1 - F) G1(i).
fn boundary(alpha: f64, o: DVec3, lattice: &Lattice, eta: f64) -> DVec2 {
    let alpha = [alpha; 2];
    let lambda_o = lambda(alpha, o);
    lattice.mean(alpha, o, |h| {
        let cosine = o.dot(h);
        let f = fresnel::dielectric(cosine, eta);
        let i = 2.0 * cosine * h - o;
        let reflected = if i.z <= 0.0 { 0.0 } else { f * smith_ratio(lambda_o, lambda(alpha, i)) };
        let square = (eta - 1.0) * (eta + 1.0) + cosine * cosine;
        let i = ((cosine - square.max(0.0).sqrt()) * h - o) / eta;
        let transmitted = if square <= 0.0 || i.z >= 0.0 { 0.0 } else { (1.0 - f) / (1.0 + lambda(alpha, i)) };
        DVec2::new(reflected, transmitted)
    })
}

/// [`boundary`] at each node of the cosine.
fn boundaries(alpha: f64, eta: f64, lattice: &Lattice) -> [DVec2; COSINES] {
    let at = |i: usize| {
        let z = cosine_at(i, alpha);
        boundary(alpha, DVec3::new((1.0 - z * z).max(0.0).sqrt(), 0.0, z), lattice, eta)
    };
    let albedos: Vec<DVec2> = (0..COSINES).into_par_iter().map(at).collect();
    std::array::from_fn(|i| albedos[i])
}

/// (1 + Λo) / (1 + Λo + Λi), also where Λo is infinite.
pub(super) fn smith_ratio(lambda_o: f64, lambda_i: f64) -> f64 {
    if lambda_o.is_infinite() { 1.0 } else { (1.0 + lambda_o) / (1.0 + lambda_o + lambda_i) }
}

/// Points of the square that visible normals are made from.
///
/// They crowd (as the cube) where the cap is cut off: there slopes are steep, and all that a smooth surface loses is lost
/// within α² of the edge. A Fibonacci lattice has no rows that the edge of total reflection could run along.
pub(super) struct Lattice(Vec<LatticePoint>);

struct LatticePoint {
    /// Height above the cap's lower end, over that of the cap.
    height: f64,
    sin: f64,
    cos: f64,
    weight: f64,
}

impl Lattice {
    pub(super) fn new((count, generator): (usize, usize)) -> Self {
        let point = |i: usize| {
            let x = (i as f64 + 0.5) / count as f64;
            let (sin, cos) = (TAU * ((i * generator % count) as f64 / count as f64)).sin_cos();
            LatticePoint { height: x * x * x, sin, cos, weight: 3.0 * x * x / count as f64 }
        };
        Lattice((0..count).map(point).collect())
    }

    /// Mean of `f` over the normals visible from `o`.
    fn mean(&self, alpha: [f64; 2], o: DVec3, f: impl Fn(DVec3) -> DVec2) -> DVec2 {
        let mut sum = DVec2::ZERO;
        self.each(alpha, o, |weight, h| sum += weight * f(h));
        sum
    }

    /// Calls `f` with points of the normals visible from `o` and their weights, which sum to 1.
    pub(super) fn each(&self, [ax, ay]: [f64; 2], o: DVec3, mut f: impl FnMut(f64, DVec3)) {
        let round = DVec3::new(ax * o.x, ay * o.y, o.z).normalize();
        for point in &self.0 {
            let height = point.height * (1.0 + round.z);
            let z = height - round.z;
            let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            let h = DVec3::new(ax * (r * point.cos + round.x), ay * (r * point.sin + round.y), height);
            f(point.weight, h.normalize());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(z: f64, azimuth: f64) -> DVec3 {
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
    }

    /// Without Fresnel loss, at α = 1 and normal incidence, 1 - ln 2 (docs/METHOD.md, Closed forms); other digits to 6e-4.
    #[test]
    fn published_albedos() {
        let e = |alpha: f64, z: f64| 1.0 - ReflectionAlbedo::new([alpha; 2]).loss(direction(z, 0.4));
        let half = e(1.0, 1.0);
        assert!((half - (1.0 - 2f64.ln())).abs() < 1e-4, "{half}");
        for (alpha, published) in [
            (0.1, [0.884, 0.936, 0.969, 0.988]),
            (0.3, [0.889, 0.818, 0.822, 0.878]),
            (0.5, [0.860, 0.746, 0.699, 0.688]),
            (0.8, [0.801, 0.632, 0.540, 0.427]),
            (1.0, [0.760, 0.560, 0.451, 0.307]),
        ] {
            for (z, want) in [0.1, 0.3, 0.5, 1.0].into_iter().zip(published) {
                // Half a digit beside.
                assert!((e(alpha, z) - want).abs() < 6e-4 + 5e-4, "α {alpha}, z {z}: {} {want}", e(alpha, z));
            }
        }
    }

    /// Tables against a finer lattice away from their nodes: the error that the types state.
    #[test]
    fn tables_are_accurate() {
        let fine = Lattice::new(FINE);
        let cosines = [0.001, 0.03, 0.2, 0.55, 0.73, 0.9, 0.995];
        for alpha in [0.05, 0.3, 1.0] {
            let table = ReflectionAlbedo::new([alpha; 2]);
            for z in cosines {
                let want = 1.0 - reflection([alpha; 2], direction(z, 0.0), &fine);
                let error = table.loss(direction(z, 1.0)) - want;
                assert!(error.abs() < 1e-4, "α {alpha}, z {z}: {error}");
            }
            for eta in if alpha == 0.3 { &[0.6, 1.5][..] } else { &[1.5] }.iter().copied() {
                let table = DielectricAlbedo::new(alpha, [eta, eta]);
                for z in cosines {
                    for behind in [false, true] {
                        let (o, relative) = (direction(z, 0.0), if behind { 1.0 / eta } else { eta });
                        let want = boundary(alpha, o, &fine, relative);
                        let error = table.loss(eta, behind, z) - (1.0 - want.x - want.y);
                        assert!(error.abs() < 6e-4, "α {alpha}, η {eta}, {behind}, z {z}: {error}");
                        let error = table.reflected(eta, behind, z) - want.x;
                        assert!(relative < 1.0 || error.abs() < 3e-4, "α {alpha}, η {eta}, z {z}: {error}");
                    }
                }
            }
        }
        for alpha in [[0.1, 0.2], [0.5, 0.05]] {
            let table = ReflectionAlbedo::new(alpha);
            for (i, z) in cosines.into_iter().enumerate() {
                let o = direction(z, 0.1 + i as f64);
                let error = 1.0 - reflection(alpha, o, &fine) - table.loss(o);
                assert!(error.abs() < 2e-4, "α {alpha:?}, {o}: {error}");
            }
        }
    }

    /// Between the nodes of η a table is as good as one made for that η.
    #[test]
    fn indices_between_nodes() {
        let (wide, eta) = (DielectricAlbedo::new(0.3, [1.45, 1.5]), 1.4631);
        let exact = DielectricAlbedo::new(0.3, [eta, eta]);
        for behind in [false, true] {
            for i in 0..=50 {
                let z = f64::from(i) / 50.0;
                assert!((wide.loss(eta, behind, z) - exact.loss(eta, behind, z)).abs() < 5e-4);
                assert!((wide.reflected(eta, false, z) - exact.reflected(eta, false, z)).abs() < 1e-4);
            }
            assert!((wide.mean_loss(eta, behind) - exact.mean_loss(eta, behind)).abs() < 1e-4);
        }
    }

    /// A coat is the front of a boundary.
    #[test]
    fn coats_are_fronts() {
        let range = [1.45, 1.5];
        let (coat, boundary) = (CoatAlbedo::new(0.2, range), DielectricAlbedo::new(0.2, range));
        for z in [0.0, 0.3, 1.0] {
            assert_eq!(coat.reflected(1.47, z), boundary.reflected(1.47, false, z));
        }
        assert_eq!(coat.mean_reflected(1.47), boundary.mean_reflected(1.47, false));
        assert_eq!(coat.table().columns[1][0], boundary.table().columns[1][0]);
    }

    #[test]
    fn nodes_invert_positions() {
        for alpha in [1e-3, 0.1, 1.0] {
            for i in 0..COSINES {
                assert!((position(cosine_at(i, alpha), alpha) - i as f64).abs() < 1e-9);
            }
        }
        for alpha in [[0.1, 0.2], [1.0, 0.01]] {
            for row in 0..AZIMUTHS {
                assert!((turn(azimuth_at(row, alpha, AZIMUTHS), alpha, AZIMUTHS) - row as f64).abs() < 1e-9);
            }
        }
    }

    /// A nearly smooth surface loses next to nothing but at grazing angles.
    #[test]
    fn a_smooth_surface_loses_nothing() {
        let table = DielectricAlbedo::new(1e-3, [1.5, 1.5]);
        for z in [0.2, 0.5, 1.0] {
            assert!(table.loss(1.5, false, z).abs() < 1e-4);
            assert!((table.reflected(1.5, false, z) - fresnel::dielectric(z, 1.5)).abs() < 2e-3);
        }
        assert!(table.mean_loss(1.5, false) < 1e-4 && ReflectionAlbedo::new([1e-3; 2]).mean_loss() < 1e-4);
    }
}
