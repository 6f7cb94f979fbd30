//! The matrices of Kwon et al. (2005), over floats and over rationals.

use crate::exact::Field;
use crate::machine::Constants;
use crate::matrix::Matrix;

/// A_r of the fourth-order model, Section III: states (λ_a, λ_b, i_a, i_b), mechanical speed ω.
pub fn reduced<F: Field>(c: &Constants<F>, omega: &F) -> Matrix<F> {
    let w = c.n_p.clone() * omega.clone();
    let mut a = Matrix::zeros(4, 4);
    a.put(0, 0, &complex(&-c.eta.clone(), &w));
    a.put(0, 2, &complex(&c.eta_l_m, &F::zero()));
    a.put(2, 0, &complex(&(c.beta.clone() * c.eta.clone()), &(-c.beta.clone() * w)));
    a.put(2, 2, &complex(&-c.gamma.clone(), &F::zero()));
    a
}

/// The real 2 × 2 form of the complex number x + jy.
pub fn complex<F: Field>(x: &F, y: &F) -> Matrix<F> {
    let mut m = Matrix::zeros(2, 2);
    m[(0, 0)] = x.clone();
    m[(1, 1)] = x.clone();
    m[(0, 1)] = -y.clone();
    m[(1, 0)] = y.clone();
    m
}

/// C_r: the currents of the fourth-order model.
pub fn reduced_output<F: Field>() -> Matrix<F> {
    Matrix::from_fn(2, 4, |i, j| if j == i + 2 { F::one() } else { F::zero() })
}

/// A of (9): states (ω, λ_a, λ_b, i_a, i_b), everything bilinear left out.
pub fn linear_part<F: Field>(c: &Constants<F>) -> Matrix<F> {
    let mut a = Matrix::zeros(5, 5);
    a[(0, 0)] = -c.friction_rate.clone();
    a.put(1, 1, &reduced(c, &F::zero()));
    a
}

/// B₂ of (9): u₂ = (λ_a i_b − λ_b i_a − τ_L/(Jμ), ω λ_b, ω λ_a).
pub fn bilinear_input<F: Field>(c: &Constants<F>) -> Matrix<F> {
    let mut b = Matrix::zeros(5, 3);
    let n_beta = c.n_p.clone() * c.beta.clone();
    b[(0, 0)] = c.mu.clone();
    b[(1, 1)] = -c.n_p.clone();
    b[(2, 2)] = c.n_p.clone();
    b[(3, 1)] = n_beta.clone();
    b[(4, 2)] = -n_beta;
    b
}

/// C of (10): the currents of the fifth-order model.
pub fn output<F: Field>() -> Matrix<F> {
    Matrix::from_fn(2, 5, |i, j| if j == i + 3 { F::one() } else { F::zero() })
}

/// Right-hand side of (1) for voltage (u_a, u_b) and load torque over inertia, in plain numbers.
pub fn derivative(c: &Constants<f64>, x: &[f64; 5], u: [f64; 2], load_rate: f64) -> [f64; 5] {
    let [omega, la, lb, ia, ib] = *x;
    let w = c.n_p * omega;
    [
        c.mu * (la * ib - lb * ia) - c.friction_rate * omega - load_rate,
        -c.eta * la - w * lb + c.eta_l_m * ia,
        -c.eta * lb + w * la + c.eta_l_m * ib,
        c.beta * (c.eta * la + w * lb) - c.gamma * ia + c.inverse_sigma_l_s * u[0],
        c.beta * (c.eta * lb - w * la) - c.gamma * ib + c.inverse_sigma_l_s * u[1],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::LinearMachine;

    #[test]
    fn linear_part_and_bilinear_input_make_up_the_machine() {
        let c = LinearMachine::kwon_table_iv().constants::<f64>();
        let x = [90.0, 0.3, -0.5, 12.0, -7.0];
        let column = Matrix::from_fn(5, 1, |i, _| x[i]);
        let u2 = Matrix::from_rows(&[[x[1] * x[4] - x[2] * x[3]], [x[0] * x[2]], [x[0] * x[1]]]);
        let dx = &(&linear_part(&c) * &column) + &(&bilinear_input(&c) * &u2);
        let reference = derivative(&c, &x, [0.0, 0.0], 0.0);
        (0..5).for_each(|i| assert!((dx[(i, 0)] - reference[i]).abs() < 1e-9 * reference[i].abs().max(1.0)));
        let reduced_part = &reduced(&c, &x[0]) * &Matrix::from_fn(4, 1, |i, _| x[i + 1]);
        (0..4).for_each(|i| assert!((reduced_part[(i, 0)] - reference[i + 1]).abs() < 1e-9 * reference[i + 1].abs()));
    }

    #[test]
    fn printed_matrices_of_section_vii() {
        let c = Constants::kwon_printed();
        let a = linear_part(&c);
        assert!((a[(3, 1)] - 1169.869).abs() < 0.15, "the printed ηβ is consistent with n_pβ to its digits");
        assert!((bilinear_input(&c)[(3, 1)] - 195.861).abs() < 1e-12);
    }
}
