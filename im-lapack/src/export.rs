//! C entry points: pointers and leading dimensions become views, the kernels do the rest.
//!
//! Every function has the contract of the Fortran routine of its name: pointers are valid for the sizes that the
//! dimensions, leading dimensions and strides imply, and outputs do not overlap inputs. Arguments are not checked
//! further, except for a job letter or range that is not implemented (negative `info`).

use crate::kernels::{self, Real, Triangle};
use core::ffi::{c_char, c_int};
use faer::{Mat, MatMut, MatRef};

/// # Safety
/// `p` is valid for reads.
unsafe fn size(p: *const c_int) -> usize {
    // SAFETY: by contract.
    usize::try_from(unsafe { *p }).unwrap_or(0)
}

/// Upper-case letter of a job, triangle or transposition argument.
///
/// # Safety
/// `p` is valid for reads.
unsafe fn letter(p: *const c_char) -> u8 {
    // SAFETY: by contract.
    (unsafe { *p } as u8).to_ascii_uppercase()
}

/// # Safety
/// `p` is valid for reads.
unsafe fn triangle(p: *const c_char) -> Triangle {
    // SAFETY: by contract.
    if unsafe { letter(p) } == b'U' { Triangle::Upper } else { Triangle::Lower }
}

/// A matrix argument, column-major with leading dimension `ld`.
///
/// # Safety
/// Valid for reads of `rows` × `cols` with that leading dimension.
unsafe fn view<'a, T>(p: *const T, rows: usize, cols: usize, ld: usize) -> MatRef<'a, T> {
    // SAFETY: by contract.
    unsafe { MatRef::from_raw_parts(p, rows, cols, 1, ld as isize) }
}

/// # Safety
/// Valid for reads and writes of `rows` × `cols` with that leading dimension, and not aliased.
unsafe fn view_mut<'a, T>(p: *mut T, rows: usize, cols: usize, ld: usize) -> MatMut<'a, T> {
    // SAFETY: by contract.
    unsafe { MatMut::from_raw_parts_mut(p, rows, cols, 1, ld as isize) }
}

/// op(A) of `rows` × `cols`, where A is stored transposed when the letter says so.
///
/// # Safety
/// As [`view`].
unsafe fn operand<'a, T>(trans: u8, p: *const T, rows: usize, cols: usize, ld: usize) -> MatRef<'a, T> {
    // SAFETY: by contract.
    unsafe { if trans == b'N' { view(p, rows, cols, ld) } else { view(p, cols, rows, ld).transpose() } }
}

/// A vector with BLAS stride: with a negative stride it runs backwards from the end.
///
/// # Safety
/// `p` is valid for `n` elements at that stride, `inc` for reads.
unsafe fn vector<'a, T>(p: *const T, n: usize, inc: *const c_int) -> MatRef<'a, T> {
    // SAFETY: by contract.
    unsafe {
        let step = *inc as isize;
        let start = if step < 0 { (n as isize - 1).max(0) * -step } else { 0 };
        MatRef::from_raw_parts(p.offset(start), n, 1, step, n as isize)
    }
}

/// # Safety
/// As [`vector`], and not aliased.
unsafe fn vector_mut<'a, T>(p: *mut T, n: usize, inc: *const c_int) -> MatMut<'a, T> {
    // SAFETY: by contract.
    unsafe {
        let step = *inc as isize;
        let start = if step < 0 { (n as isize - 1).max(0) * -step } else { 0 };
        MatMut::from_raw_parts_mut(p.offset(start), n, 1, step, n as isize)
    }
}

fn copy<T: Copy>(mut to: MatMut<'_, T>, from: MatRef<'_, T>) {
    for j in 0..to.ncols() {
        for i in 0..to.nrows() {
            to[(i, j)] = from[(i, j)];
        }
    }
}

/// What ?syevr selects: eigenvalues `from..to` of those in ascending order.
fn selection<T: Real>(range: u8, values: &[T], vl: T, vu: T, il: c_int, iu: c_int) -> Option<core::ops::Range<usize>> {
    match range {
        b'A' => Some(0..values.len()),
        b'V' => {
            let from = values.iter().take_while(|v| **v <= vl).count();
            let to = values.iter().take_while(|v| **v <= vu).count();
            Some(from..to.max(from))
        }
        b'I' => Some(usize::try_from(il - 1).ok()?..usize::try_from(iu).ok()?.min(values.len())),
        _ => None,
    }
}

macro_rules! routines {
    ($t:ty, $gemm:ident, $gemv:ident, $symv:ident, $syrk:ident, $syr2k:ident, $potrf:ident, $potrs:ident, $gesv:ident,
     $syevr:ident, $gesdd:ident, $gesvd:ident) => {
/// C ← α op(A) op(B) + β C. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $gemm(
            transa: *const c_char, transb: *const c_char, m: *const c_int, n: *const c_int, k: *const c_int,
            alpha: *const $t, a: *const $t, lda: *const c_int, b: *const $t, ldb: *const c_int,
            beta: *const $t, c: *mut $t, ldc: *const c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let (m, n, k) = (size(m), size(n), size(k));
                let a = operand(letter(transa), a, m, k, size(lda));
                let b = operand(letter(transb), b, k, n, size(ldb));
                kernels::gemm(*alpha, a, b, *beta, view_mut(c, m, n, size(ldc)));
            }
        }

/// y ← α op(A) x + β y. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $gemv(
            trans: *const c_char, m: *const c_int, n: *const c_int, alpha: *const $t, a: *const $t, lda: *const c_int,
            x: *const $t, incx: *const c_int, beta: *const $t, y: *mut $t, incy: *const c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let a = view(a, size(m), size(n), size(lda));
                let a = if letter(trans) == b'N' { a } else { a.transpose() };
                let x = vector(x, a.ncols(), incx);
                kernels::gemm(*alpha, a, x, *beta, vector_mut(y, a.nrows(), incy));
            }
        }

/// y ← α A x + β y, A symmetric. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $symv(
            uplo: *const c_char, n: *const c_int, alpha: *const $t, a: *const $t, lda: *const c_int,
            x: *const $t, incx: *const c_int, beta: *const $t, y: *mut $t, incy: *const c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let n = size(n);
                let a = kernels::symmetric(triangle(uplo), view(a, n, n, size(lda)));
                kernels::gemm(*alpha, a.as_ref(), vector(x, n, incx), *beta, vector_mut(y, n, incy));
            }
        }

/// C ← α op(A) op(A)ᵀ + β C. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $syrk(
            uplo: *const c_char, trans: *const c_char, n: *const c_int, k: *const c_int, alpha: *const $t,
            a: *const $t, lda: *const c_int, beta: *const $t, c: *mut $t, ldc: *const c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let (n, k) = (size(n), size(k));
                let a = operand(letter(trans), a, n, k, size(lda));
                kernels::syrk(triangle(uplo), *alpha, a, *beta, view_mut(c, n, n, size(ldc)));
            }
        }

/// C ← α (op(A) op(B)ᵀ + op(B) op(A)ᵀ) + β C. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $syr2k(
            uplo: *const c_char, trans: *const c_char, n: *const c_int, k: *const c_int, alpha: *const $t,
            a: *const $t, lda: *const c_int, b: *const $t, ldb: *const c_int,
            beta: *const $t, c: *mut $t, ldc: *const c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let (n, k) = (size(n), size(k));
                let a = operand(letter(trans), a, n, k, size(lda));
                let b = operand(letter(trans), b, n, k, size(ldb));
                kernels::syr2k(triangle(uplo), *alpha, a, b, *beta, view_mut(c, n, n, size(ldc)));
            }
        }

/// Cholesky factor. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $potrf(
            uplo: *const c_char, n: *const c_int, a: *mut $t, lda: *const c_int, info: *mut c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let n = size(n);
                let result = kernels::potrf(triangle(uplo), view_mut(a, n, n, size(lda)));
                *info = result.err().map_or(0, |minor| minor as c_int);
            }
        }

/// Solve with a Cholesky factor. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $potrs(
            uplo: *const c_char, n: *const c_int, nrhs: *const c_int, a: *const $t, lda: *const c_int,
            b: *mut $t, ldb: *const c_int, info: *mut c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let (n, nrhs) = (size(n), size(nrhs));
                kernels::potrs(triangle(uplo), view(a, n, n, size(lda)), view_mut(b, n, nrhs, size(ldb)));
                *info = 0;
            }
        }

/// Solve by LU. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $gesv(
            n: *const c_int, nrhs: *const c_int, a: *mut $t, lda: *const c_int, ipiv: *mut c_int,
            b: *mut $t, ldb: *const c_int, info: *mut c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let (n, nrhs) = (size(n), size(nrhs));
                let mut pivots = vec![0; n];
                let a = view_mut(a, n, n, size(lda));
                let result = kernels::gesv(a, &mut pivots, view_mut(b, n, nrhs, size(ldb)));
                for (i, p) in pivots.iter().enumerate() {
                    *ipiv.add(i) = *p as c_int + 1;
                }
                *info = result.err().map_or(0, |pivot| pivot as c_int);
            }
        }

/// Symmetric eigenvalues and vectors. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $syevr(
            jobz: *const c_char, range: *const c_char, uplo: *const c_char, n: *const c_int,
            a: *mut $t, lda: *const c_int, vl: *const $t, vu: *const $t, il: *const c_int, iu: *const c_int,
            _abstol: *const $t, m: *mut c_int, w: *mut $t, z: *mut $t, ldz: *const c_int, isuppz: *mut c_int,
            work: *mut $t, lwork: *const c_int, iwork: *mut c_int, liwork: *const c_int, info: *mut c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                *info = 0;
                if *lwork == -1 || *liwork == -1 {
                    *work = 1.0;
                    *iwork = 1;
                    return;
                }
                let n = size(n);
                *m = 0;
                if n == 0 {
                    return;
                }
                let Ok((values, vectors)) = kernels::syevr(triangle(uplo), view(a, n, n, size(lda))) else {
                    *info = 1;
                    return;
                };
                let Some(chosen) = selection(letter(range), &values, *vl, *vu, *il, *iu) else {
                    *info = -2;
                    return;
                };
                *m = chosen.len() as c_int;
                for (out, index) in chosen.clone().enumerate() {
                    *w.add(out) = values[index];
                }
                if letter(jobz) == b'V' {
                    let chosen_vectors = vectors.as_ref().subcols(chosen.start, chosen.len());
                    copy(view_mut(z, n, chosen.len(), size(ldz)), chosen_vectors);
                    for k in 0..chosen.len() {
                        *isuppz.add(2 * k) = 1;
                        *isuppz.add(2 * k + 1) = n as c_int;
                    }
                }
            }
        }

/// Singular values and vectors (divide and conquer). # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $gesdd(
            jobz: *const c_char, m: *const c_int, n: *const c_int, a: *mut $t, lda: *const c_int,
            s: *mut $t, u: *mut $t, ldu: *const c_int, vt: *mut $t, ldvt: *const c_int,
            work: *mut $t, lwork: *const c_int, _iwork: *mut c_int, info: *mut c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe { $gesvd(jobz, jobz, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info) }
        }

/// Singular values and vectors. # Safety: the contract of the Fortran routine.
        #[unsafe(no_mangle)]
        #[rustfmt::skip]
        unsafe extern "C" fn $gesvd(
            jobu: *const c_char, jobvt: *const c_char, m: *const c_int, n: *const c_int, a: *mut $t, lda: *const c_int,
            s: *mut $t, u: *mut $t, ldu: *const c_int, vt: *mut $t, ldvt: *const c_int,
            work: *mut $t, lwork: *const c_int, info: *mut c_int,
        ) {
            // SAFETY: the caller keeps the contract of the Fortran routine.
            unsafe {
                let (jobu, jobvt) = (letter(jobu), letter(jobvt));
                *info = 0;
                if !b"ASN".contains(&jobu) {
                    *info = -1;
                    return;
                }
                if !b"ASN".contains(&jobvt) {
                    *info = -2;
                    return;
                }
                if *lwork == -1 {
                    *work = 1.0;
                    return;
                }
                let (m, n) = (size(m), size(n));
                let full = jobu == b'A' || jobvt == b'A';
                let Ok((values, left, right)) = kernels::svd(view(a, m, n, size(lda)), full) else {
                    *info = 1;
                    return;
                };
                for (i, value) in values.iter().enumerate() {
                    *s.add(i) = *value;
                }
                let columns = |job: u8, all: usize| if job == b'A' { all } else { m.min(n) };
                if jobu != b'N' {
                    let wanted: &Mat<$t> = &left;
                    let k = columns(jobu, m);
                    copy(view_mut(u, m, k, size(ldu)), wanted.as_ref().subcols(0, k));
                }
                if jobvt != b'N' {
                    let wanted: &Mat<$t> = &right;
                    let k = columns(jobvt, n);
                    copy(view_mut(vt, k, n, size(ldvt)), wanted.as_ref().subrows(0, k));
                }
            }
        }
    };
}

routines!(f64, dgemm_, dgemv_, dsymv_, dsyrk_, dsyr2k_, dpotrf_, dpotrs_, dgesv_, dsyevr_, dgesdd_, dgesvd_);
routines!(f32, sgemm_, sgemv_, ssymv_, ssyrk_, ssyr2k_, spotrf_, spotrs_, sgesv_, ssyevr_, sgesdd_, sgesvd_);
