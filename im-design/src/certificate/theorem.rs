//! What a certificate claims, in a sentence.

use super::file::Design;

impl Design {
    /// What is proven of the machine over the region, and what one might think is proven and is not.
    pub fn theorem(&self) -> &'static str {
        match self {
            Design::Thau(_) => {
                "For every nonlinear part u2 with this Lipschitz constant the error of speed, flux and current decays, wherever it begins. \
                 Whether the machine's own u2 has it is not claimed."
            }
            Design::SampledThau(_) => {
                "For every nonlinear part u2 with this Lipschitz constant the error of speed, flux and current shrinks every sample by \
                 the factor of the contraction, observer and machine stepped by forward Euler. Whether the machine's own u2 has it is not claimed."
            }
            Design::ThauBox(_) => {
                "While the means of true and estimated state and the frame stay in the box, the error of speed, flux and current decays at \
                 the rate, the load torque being what the observer takes it for. That they stay there is not claimed."
            }
            Design::SampledThauBox(_) => {
                "While the means of true and estimated state and the frame stay in the box, the error of speed, flux and current shrinks \
                 every sample by the factor of the contraction, observer and machine stepped by forward Euler in the frame. That they stay there is not \
                 claimed."
            }
            Design::Kubota(_) => {
                "At a known speed in the range, however it changes, the error of flux and current decays at the rate. The speed law is not \
                 part of it."
            }
            Design::Sampled(_) => {
                "At a known speed in the range, however it changes, the error of flux and current shrinks every sample by the factor \
                 of the contraction, observer and machine stepped by forward Euler. The speed law is not part of it."
            }
            Design::KubotaLoop(_) => {
                "For small errors about every operating point of the region the linearized loop of flux, current and estimated speed is \
                 stable, at the rate or faster. Large errors and another flux are not part of it."
            }
            Design::SampledKubotaLoop(_) => {
                "For small errors about every operating point of the region the linearized loop of flux, current and estimated speed, \
                 stepped by forward Euler, shrinks every sample by the factor of the contraction at least. Large errors and another flux are not part of it."
            }
            Design::Derdiyok(_) => {
                "While speed and flux of the machine stay below the bounds, the estimated current slides on the measured one, from any error \
                 of it. That the estimated flux and speed converge is not claimed."
            }
            Design::SampledDerdiyok(_) => {
                "While speed and flux of the machine stay below the bounds, the error of the current enters the boundary layer and stays in \
                 it, observer and machine stepped by forward Euler. That the estimated flux and speed converge is not claimed."
            }
            Design::Utkin(_) => {
                "While the errors of flux and current stay below the bounds, s_n = Im(conj(estimated flux) x current error) slides on zero. \
                 Neither that they stay there nor that the estimated flux and speed converge is claimed."
            }
            Design::SampledUtkin(_) => {
                "While the errors of flux and current stay below the bounds, s_n = Im(conj(estimated flux) x current error) enters the \
                 boundary layer and stays in it. Neither that they stay there nor that the estimated flux and speed converge is claimed."
            }
            Design::Kenne(_) => {
                "Within the bounds of resistances, flux, load and references the surfaces of speed and flux are reached and held, on which \
                 their errors decay at c_omega and c_lambda, and the estimate of R_r follows it. That current and voltage stay below their \
                 bounds is not claimed."
            }
            Design::SampledKenne(_) => {
                "Within the bounds of resistances, flux, load and references s_omega and s_lambda enter their boundary layers and stay in \
                 them, the law computed once a sample and held, and the estimate of R_r follows it. That current and voltage stay below \
                 their bounds is not claimed."
            }
            Design::Jadot(_) => {
                "With the parameters known the errors of current and flux decay at their rate while speed and slip stay in the region, \
                 however they change; so does, for small errors about every operating point, the linearized loop of speed and flux. The \
                 adaptation is not part of it."
            }
            Design::SampledJadot(_) => {
                "With the parameters known and the control held over every sample the errors of current and flux decay at their rate while \
                 speed and slip stay in a cell of the region; so does, for small errors about every operating point, the linearized loop of \
                 speed and flux. The adaptation is not part of it."
            }
            Design::Mtpa(_) => {
                "At every torque of the range the steady state of the circuit gives it with the law's current and slip, within the tolerance, \
                 and no operating point gives it with less current than that, within the tolerance."
            }
        }
    }
}
