//! Each exported symbol, called as a C or Fortran program would, against nalgebra.
//!
//! Safety, for every block below: all pointers come from slices that hold the sizes passed along, and no output overlaps
//! an input.
#![cfg(feature = "pure-rust")]
#![allow(clippy::undocumented_unsafe_blocks)]

use core::ffi::{c_char, c_int};
use im_lapack as _;
use nalgebra::DMatrix;

#[rustfmt::skip]
unsafe extern "C" {
    fn dgemm_(ta: *const c_char, tb: *const c_char, m: *const c_int, n: *const c_int, k: *const c_int, alpha: *const f64,
        a: *const f64, lda: *const c_int, b: *const f64, ldb: *const c_int, beta: *const f64, c: *mut f64, ldc: *const c_int);
    fn dgemv_(t: *const c_char, m: *const c_int, n: *const c_int, alpha: *const f64, a: *const f64, lda: *const c_int,
        x: *const f64, incx: *const c_int, beta: *const f64, y: *mut f64, incy: *const c_int);
    fn dsymv_(u: *const c_char, n: *const c_int, alpha: *const f64, a: *const f64, lda: *const c_int,
        x: *const f64, incx: *const c_int, beta: *const f64, y: *mut f64, incy: *const c_int);
    fn dsyrk_(u: *const c_char, t: *const c_char, n: *const c_int, k: *const c_int, alpha: *const f64,
        a: *const f64, lda: *const c_int, beta: *const f64, c: *mut f64, ldc: *const c_int);
    fn dsyr2k_(u: *const c_char, t: *const c_char, n: *const c_int, k: *const c_int, alpha: *const f64,
        a: *const f64, lda: *const c_int, b: *const f64, ldb: *const c_int, beta: *const f64, c: *mut f64, ldc: *const c_int);
    fn dpotrf_(u: *const c_char, n: *const c_int, a: *mut f64, lda: *const c_int, info: *mut c_int);
    fn dpotrs_(u: *const c_char, n: *const c_int, nrhs: *const c_int, a: *const f64, lda: *const c_int,
        b: *mut f64, ldb: *const c_int, info: *mut c_int);
    fn dgesv_(n: *const c_int, nrhs: *const c_int, a: *mut f64, lda: *const c_int, ipiv: *mut c_int,
        b: *mut f64, ldb: *const c_int, info: *mut c_int);
    fn dsyevr_(jobz: *const c_char, range: *const c_char, uplo: *const c_char, n: *const c_int, a: *mut f64,
        lda: *const c_int, vl: *const f64, vu: *const f64, il: *const c_int, iu: *const c_int, abstol: *const f64,
        m: *mut c_int, w: *mut f64, z: *mut f64, ldz: *const c_int, isuppz: *mut c_int, work: *mut f64,
        lwork: *const c_int, iwork: *mut c_int, liwork: *const c_int, info: *mut c_int);
    fn dgesdd_(jobz: *const c_char, m: *const c_int, n: *const c_int, a: *mut f64, lda: *const c_int, s: *mut f64,
        u: *mut f64, ldu: *const c_int, vt: *mut f64, ldvt: *const c_int, work: *mut f64, lwork: *const c_int,
        iwork: *mut c_int, info: *mut c_int);
    fn sgemm_(ta: *const c_char, tb: *const c_char, m: *const c_int, n: *const c_int, k: *const c_int, alpha: *const f32,
        a: *const f32, lda: *const c_int, b: *const f32, ldb: *const c_int, beta: *const f32, c: *mut f32, ldc: *const c_int);
    fn sgesvd_(jobu: *const c_char, jobvt: *const c_char, m: *const c_int, n: *const c_int, a: *mut f32,
        lda: *const c_int, s: *mut f32, u: *mut f32, ldu: *const c_int, vt: *mut f32, ldvt: *const c_int,
        work: *mut f32, lwork: *const c_int, info: *mut c_int);
}

const LD: usize = 9;
const LDI: c_int = LD as c_int;

/// A repeatable matrix without structure.
fn sample(rows: usize, cols: usize, seed: u64) -> DMatrix<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    DMatrix::from_fn(rows, cols, |_, _| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    })
}

fn symmetric(n: usize, seed: u64) -> DMatrix<f64> {
    let a = sample(n, n, seed);
    &a * a.transpose() + DMatrix::identity(n, n) * 0.1
}

/// Column-major with leading dimension `LD`, the gap filled with NaN: it must never be touched.
fn padded(a: &DMatrix<f64>) -> Vec<f64> {
    let mut data = vec![f64::NAN; LD * a.ncols()];
    for j in 0..a.ncols() {
        for i in 0..a.nrows() {
            data[i + j * LD] = a[(i, j)];
        }
    }
    data
}

fn unpadded(data: &[f64], rows: usize, cols: usize) -> DMatrix<f64> {
    for (k, value) in data.iter().enumerate() {
        assert_eq!(k % LD >= rows, value.is_nan(), "the gap below the matrix was written, or NaN came out");
    }
    DMatrix::from_fn(rows, cols, |i, j| data[i + j * LD])
}

fn close(a: &DMatrix<f64>, b: &DMatrix<f64>) {
    assert!((a - b).norm() < 1e-12 * (1.0 + b.norm()), "{a} against {b}");
}

/// The stored triangle of `new` must be that of `full`; the other one must still hold what `old` held.
fn triangle_close(uplo: u8, new: &DMatrix<f64>, full: &DMatrix<f64>, old: &DMatrix<f64>) {
    let stored = |i: usize, j: usize| if uplo == b'L' { i >= j } else { i <= j };
    let expected = DMatrix::from_fn(new.nrows(), new.ncols(), |i, j| if stored(i, j) { full[(i, j)] } else { old[(i, j)] });
    close(new, &expected);
}

fn c(letter: u8) -> c_char {
    letter as c_char
}

#[test]
fn gemm_with_both_transpositions() {
    let (m, n, k) = (4usize, 5usize, 3usize);
    for (ta, tb) in [(b'N', b'N'), (b'T', b'N'), (b'N', b'T'), (b'T', b'T')] {
        let (a, b, start) = (sample(m, k, 1), sample(k, n, 2), sample(m, n, 3));
        let stored_a = padded(&if ta == b'N' { a.clone() } else { a.transpose() });
        let stored_b = padded(&if tb == b'N' { b.clone() } else { b.transpose() });
        let mut out = padded(&start);
        unsafe {
            dgemm_(
                &c(ta),
                &c(tb),
                &(m as c_int),
                &(n as c_int),
                &(k as c_int),
                &1.5,
                stored_a.as_ptr(),
                &LDI,
                stored_b.as_ptr(),
                &LDI,
                &-0.5,
                out.as_mut_ptr(),
                &LDI,
            );
        }
        close(&unpadded(&out, m, n), &(1.5 * a * b - 0.5 * start));
    }
}

#[test]
fn gemm_with_zero_beta_ignores_nan() {
    let mut out = [f32::NAN; 4];
    let (a, n) = ([1.0f32, 2.0, 3.0, 4.0], 2);
    unsafe {
        sgemm_(&c(b'N'), &c(b'N'), &n, &n, &n, &1.0, a.as_ptr(), &n, a.as_ptr(), &n, &0.0, out.as_mut_ptr(), &n);
    }
    assert_eq!(out, [7.0, 10.0, 15.0, 22.0]);
}

#[test]
fn gemv_and_symv_with_strides() {
    let (m, n) = (4usize, 3usize);
    let (a, x, y) = (sample(m, n, 4), sample(n, 1, 5), sample(m, 1, 6));
    let mut xs = vec![0.0; 2 * n];
    (0..n).for_each(|i| xs[2 * (n - 1 - i)] = x[i]); // backwards with step 2
    let mut out: Vec<f64> = y.iter().copied().collect();
    unsafe {
        dgemv_(
            &c(b'N'),
            &(m as c_int),
            &(n as c_int),
            &2.0,
            padded(&a).as_ptr(),
            &LDI,
            xs.as_ptr(),
            &-2,
            &3.0,
            out.as_mut_ptr(),
            &1,
        );
    }
    close(&DMatrix::from_vec(m, 1, out), &(2.0 * &a * &x + 3.0 * &y));

    let mut out: Vec<f64> = x.iter().copied().collect();
    unsafe {
        dgemv_(
            &c(b'T'),
            &(m as c_int),
            &(n as c_int),
            &2.0,
            padded(&a).as_ptr(),
            &LDI,
            y.as_ptr(),
            &1,
            &1.0,
            out.as_mut_ptr(),
            &1,
        );
    }
    close(&DMatrix::from_vec(n, 1, out), &(2.0 * a.transpose() * &y + &x));

    for uplo in [b'L', b'U'] {
        let s = symmetric(m, 7);
        let mut half = s.clone();
        half.fill_with_identity();
        triangle_fill(uplo, &s, &mut half);
        let mut out: Vec<f64> = y.iter().copied().collect();
        let x = sample(m, 1, 8);
        unsafe {
            dsymv_(&c(uplo), &(m as c_int), &0.5, padded(&half).as_ptr(), &LDI, x.as_ptr(), &1, &1.0, out.as_mut_ptr(), &1);
        }
        close(&DMatrix::from_vec(m, 1, out), &(0.5 * s * x + &y));
    }
}

fn triangle_fill(uplo: u8, from: &DMatrix<f64>, to: &mut DMatrix<f64>) {
    for j in 0..from.ncols() {
        for i in 0..from.nrows() {
            let stored = if uplo == b'L' { i >= j } else { i <= j };
            to[(i, j)] = if stored { from[(i, j)] } else { 7.0 };
        }
    }
}

#[test]
fn syrk_and_syr2k_touch_one_triangle() {
    let (n, k) = (5usize, 3usize);
    for uplo in [b'L', b'U'] {
        for trans in [b'N', b'T'] {
            let (a, b, start) = (sample(n, k, 9), sample(n, k, 10), sample(n, n, 11));
            let stored = |x: &DMatrix<f64>| padded(&if trans == b'N' { x.clone() } else { x.transpose() });
            let mut out = padded(&start);
            unsafe {
                dsyrk_(
                    &c(uplo),
                    &c(trans),
                    &(n as c_int),
                    &(k as c_int),
                    &2.0,
                    stored(&a).as_ptr(),
                    &LDI,
                    &0.5,
                    out.as_mut_ptr(),
                    &LDI,
                );
            }
            let full = 2.0 * &a * a.transpose() + 0.5 * &start;
            triangle_close(uplo, &unpadded(&out, n, n), &full, &start);

            let mut out = padded(&start);
            unsafe {
                dsyr2k_(
                    &c(uplo),
                    &c(trans),
                    &(n as c_int),
                    &(k as c_int),
                    &2.0,
                    stored(&a).as_ptr(),
                    &LDI,
                    stored(&b).as_ptr(),
                    &LDI,
                    &0.5,
                    out.as_mut_ptr(),
                    &LDI,
                );
            }
            let full = 2.0 * (&a * b.transpose() + &b * a.transpose()) + 0.5 * &start;
            triangle_close(uplo, &unpadded(&out, n, n), &full, &start);
        }
    }
}

#[test]
fn potrf_and_potrs_solve_and_report_the_minor() {
    let (n, nrhs) = (6usize, 2usize);
    for uplo in [b'L', b'U'] {
        let (a, b) = (symmetric(n, 12), sample(n, nrhs, 13));
        let mut factor = padded(&a);
        let mut x = padded(&b);
        let mut info = -9;
        unsafe {
            dpotrf_(&c(uplo), &(n as c_int), factor.as_mut_ptr(), &LDI, &mut info);
        }
        assert_eq!(info, 0);
        let l = a.clone().cholesky().unwrap().l();
        let full = if uplo == b'L' { l } else { l.transpose() };
        triangle_close(uplo, &unpadded(&factor, n, n), &full, &a);
        unsafe {
            dpotrs_(&c(uplo), &(n as c_int), &2, factor.as_ptr(), &LDI, x.as_mut_ptr(), &LDI, &mut info);
        }
        close(&unpadded(&x, n, nrhs), &a.clone().lu().solve(&b).unwrap());

        let mut indefinite = a.clone();
        indefinite[(3, 3)] = -1.0;
        let mut factor = padded(&indefinite);
        unsafe {
            dpotrf_(&c(uplo), &(n as c_int), factor.as_mut_ptr(), &LDI, &mut info);
        }
        assert_eq!(info, 4, "the fourth leading minor is the first that is not positive");
    }
}

#[test]
fn gesv_solves_permutes_and_reports_singularity() {
    let (n, nrhs) = (6usize, 2usize);
    let (a, b) = (sample(n, n, 14), sample(n, nrhs, 15));
    let (mut lu, mut x, mut ipiv, mut info) = (padded(&a), padded(&b), vec![0; n], -9);
    unsafe {
        dgesv_(&(n as c_int), &2, lu.as_mut_ptr(), &LDI, ipiv.as_mut_ptr(), x.as_mut_ptr(), &LDI, &mut info);
    }
    assert_eq!(info, 0);
    close(&unpadded(&x, n, nrhs), &a.clone().lu().solve(&b).unwrap());
    let lu = unpadded(&lu, n, n);
    let mut product = lu.lower_triangle();
    product.fill_diagonal(1.0);
    let mut product = product * lu.upper_triangle();
    for (k, p) in ipiv.iter().enumerate().rev() {
        product.swap_rows(k, *p as usize - 1);
    }
    close(&product, &a);

    let mut zero = vec![0.0; 4];
    let (mut x, mut ipiv) = (vec![1.0; 2], vec![0; 2]);
    unsafe { dgesv_(&2, &1, zero.as_mut_ptr(), &2, ipiv.as_mut_ptr(), x.as_mut_ptr(), &2, &mut info) };
    assert_eq!(info, 1);
}

#[test]
fn syevr_gives_ascending_eigenvalues_and_vectors() {
    let n = 6usize;
    let s = symmetric(n, 16) - DMatrix::identity(n, n) * 0.4;
    for uplo in [b'L', b'U'] {
        for (range, il, iu) in [(b'A', 0, 0), (b'I', 2, 4)] {
            let mut half = s.clone();
            triangle_fill(uplo, &s, &mut half);
            let (mut a, mut z) = (padded(&half), padded(&DMatrix::zeros(n, n)));
            let (mut w, mut m, mut info, mut work, mut iwork) = (vec![0.0; n], 0, -9, vec![0.0], vec![0]);
            let mut isuppz = vec![0; 2 * n];
            let mut call = |lwork: c_int| unsafe {
                dsyevr_(
                    &c(b'V'),
                    &c(range),
                    &c(uplo),
                    &(n as c_int),
                    a.as_mut_ptr(),
                    &LDI,
                    &0.0,
                    &0.0,
                    &il,
                    &iu,
                    &0.0,
                    &mut m,
                    w.as_mut_ptr(),
                    z.as_mut_ptr(),
                    &LDI,
                    isuppz.as_mut_ptr(),
                    work.as_mut_ptr(),
                    &lwork,
                    iwork.as_mut_ptr(),
                    &lwork,
                    &mut info,
                );
                (m as usize, info)
            };
            assert_eq!(call(-1).1, 0, "workspace query");
            let (m, info) = call(1);
            assert_eq!((m, info), (if range == b'A' { n } else { 3 }, 0));
            let mut expected: Vec<f64> = s.clone().symmetric_eigen().eigenvalues.iter().copied().collect();
            expected.sort_by(f64::total_cmp);
            let first = if range == b'A' { 0 } else { 1 };
            let z = unpadded(&z, n, n).columns(0, m).into_owned();
            for k in 0..m {
                assert!((w[k] - expected[first + k]).abs() < 1e-12);
                assert!((&s * z.column(k) - w[k] * z.column(k)).norm() < 1e-12);
            }
            close(&(z.transpose() * &z), &DMatrix::identity(m, m));
        }
    }
}

#[test]
fn gesdd_reconstructs_tall_and_wide() {
    for (m, n) in [(6usize, 4usize), (4, 6), (5, 5)] {
        for job in [b'S', b'A', b'N', b'O'] {
            let a = sample(m, n, 17);
            let r = m.min(n);
            let (ku, kv) = if job == b'A' { (m, n) } else { (r, r) };
            let (mut data, mut s) = (padded(&a), vec![0.0; r]);
            let (mut u, mut vt) = (padded(&DMatrix::zeros(m, ku)), padded(&DMatrix::zeros(kv, n)));
            let (mut work, mut iwork, mut info) = (vec![0.0], vec![0; 8 * r], -9);
            unsafe {
                dgesdd_(
                    &c(job),
                    &(m as c_int),
                    &(n as c_int),
                    data.as_mut_ptr(),
                    &LDI,
                    s.as_mut_ptr(),
                    u.as_mut_ptr(),
                    &LDI,
                    vt.as_mut_ptr(),
                    &LDI,
                    work.as_mut_ptr(),
                    &1,
                    iwork.as_mut_ptr(),
                    &mut info,
                );
            }
            if job == b'O' {
                assert_eq!(info, -1);
                continue;
            }
            assert_eq!(info, 0);
            let expected = a.clone().svd(false, false).singular_values;
            assert!(s.iter().zip(expected.iter()).all(|(x, y)| (x - y).abs() < 1e-12));
            if job != b'N' {
                let (u, vt) = (unpadded(&u, m, ku), unpadded(&vt, kv, n));
                let sigma = DMatrix::from_fn(ku, kv, |i, j| if i == j { s[i] } else { 0.0 });
                close(&(&u * sigma * &vt), &a);
                close(&(u.transpose() * &u), &DMatrix::identity(ku, ku));
                close(&(&vt * vt.transpose()), &DMatrix::identity(kv, kv));
            }
        }
    }
}

#[test]
fn single_precision_gesvd() {
    let mut a = [3.0f32, 0.0, 0.0, -2.0];
    let (mut s, mut u, mut vt, mut work, mut info) = ([0.0f32; 2], [0.0f32; 4], [0.0f32; 4], [0.0f32], -9);
    unsafe {
        sgesvd_(
            &c(b'S'),
            &c(b'S'),
            &2,
            &2,
            a.as_mut_ptr(),
            &2,
            s.as_mut_ptr(),
            u.as_mut_ptr(),
            &2,
            vt.as_mut_ptr(),
            &2,
            work.as_mut_ptr(),
            &1,
            &mut info,
        );
    }
    assert_eq!(info, 0);
    assert!((s[0] - 3.0).abs() < 1e-6 && (s[1] - 2.0).abs() < 1e-6);
    let entry = |i: usize, j: usize| (0..2).map(|k| u[i + 2 * k] * s[k] * vt[k + 2 * j]).sum::<f32>();
    assert!((entry(0, 0) - 3.0).abs() < 1e-5 && (entry(1, 1) + 2.0).abs() < 1e-5 && entry(0, 1).abs() < 1e-5);
}
