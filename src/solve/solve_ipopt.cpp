#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <mutex>

#include "rayrep/base/error.h"
#include "rayrep/solve/solve.h"

namespace rayrep {
namespace {

using Ipopt::Index;
using Ipopt::Number;

/// Hands an Nlp to Ipopt and keeps what it finds.
class Adapter final : public Ipopt::TNLP {
public:
  Adapter(const Nlp& nlp, const Progress& progress, SolveReport& report)
      : nlp_(nlp), progress_(progress), report_(report), jacobian_(nlp.jacobian_pattern()), hessian_(nlp.hessian_pattern()) {}

  bool interrupted() const { return interrupted_; }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag, IndexStyleEnum& index_style) override {
    n = static_cast<Index>(nlp_.variables());
    m = static_cast<Index>(nlp_.constraints());
    nnz_jac_g = static_cast<Index>(jacobian_.size());
    nnz_h_lag = static_cast<Index>(hessian_.size());
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l, Number* g_u) override {
    Eigen::Map<Eigen::VectorXd>(x_l, n) = nlp_.lower_bounds();
    Eigen::Map<Eigen::VectorXd>(x_u, n) = nlp_.upper_bounds();
    std::fill(g_l, g_l + m, 0.0);
    Eigen::Map<Eigen::VectorXd>(g_u, m) = nlp_.constraint_upper_bounds().cwiseMin(2e19);  // beyond 1e19 Ipopt reads infinity
    return true;
  }

  bool get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    Eigen::Map<Eigen::VectorXd>(x, n) = nlp_.start();
    return true;
  }

  bool eval_f(Index n, const Number* x, bool, Number& value) override {
    value = nlp_.objective(map(x, n));
    return true;
  }

  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override {
    Eigen::Map<Eigen::VectorXd>(gradient, n) = nlp_.gradient(map(x, n));
    return true;
  }

  bool eval_g(Index n, const Number* x, bool, Index m, Number* g) override {
    Eigen::Map<Eigen::VectorXd>(g, m) = nlp_.constraint_values(map(x, n));
    return true;
  }

  bool eval_jac_g(Index n, const Number* x, bool, Index, Index count, Index* rows, Index* columns, Number* values) override {
    if (values)
      Eigen::Map<Eigen::VectorXd>(values, count) = nlp_.jacobian_values(map(x, n));
    else
      write_pattern(jacobian_, rows, columns);
    return true;
  }

  bool eval_h(Index n, const Number* x, bool, Number factor, Index m, const Number* mu, bool, Index count, Index* rows,
              Index* columns, Number* values) override {
    if (values)
      Eigen::Map<Eigen::VectorXd>(values, count) = nlp_.hessian_values(map(x, n), factor, map(mu, m));
    else
      write_pattern(hessian_, rows, columns);
    return true;
  }

  bool intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number, Number, Number, Number, Number, Number, Number,
                             Index, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    report_.iterations = iteration;
    interrupted_ = progress_.cancelled && progress_.cancelled();
    return !interrupted_;
  }

  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*, const Number*, Index m, const Number* g,
                         const Number* mu, Number objective, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    // Ipopt relaxes bounds by 1e-8; ours are meant.
    report_.x = map(x, n).cwiseMax(nlp_.lower_bounds()).cwiseMin(nlp_.upper_bounds());
    report_.multipliers = map(mu, m);
    report_.objective = objective;
    const Eigen::VectorXd above = map(g, m) - nlp_.constraint_upper_bounds();
    report_.constraint_violation = m > 0 ? std::max({0.0, above.maxCoeff(), -map(g, m).minCoeff()}) : 0;
  }

private:
  static Eigen::Map<const Eigen::VectorXd> map(const Number* values, Index count) { return {values, count}; }

  static void write_pattern(const Nlp::Pattern& pattern, Index* rows, Index* columns) {
    for (std::size_t n = 0; n < pattern.size(); ++n) {
      rows[n] = pattern[n].first;
      columns[n] = pattern[n].second;
    }
  }

  const Nlp& nlp_;
  const Progress& progress_;
  SolveReport& report_;
  Nlp::Pattern jacobian_;
  Nlp::Pattern hessian_;
  bool interrupted_ = false;
};

std::string name_of(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
      return "Solve_Succeeded";
    case Ipopt::Solved_To_Acceptable_Level:
      return "Solved_To_Acceptable_Level";
    case Ipopt::Infeasible_Problem_Detected:
      return "Infeasible_Problem_Detected";
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return "Search_Direction_Becomes_Too_Small";
    case Ipopt::Diverging_Iterates:
      return "Diverging_Iterates";
    case Ipopt::User_Requested_Stop:
      return "User_Requested_Stop";
    case Ipopt::Maximum_Iterations_Exceeded:
      return "Maximum_Iterations_Exceeded";
    case Ipopt::Restoration_Failed:
      return "Restoration_Failed";
    case Ipopt::Error_In_Step_Computation:
      return "Error_In_Step_Computation";
    case Ipopt::Maximum_CpuTime_Exceeded:
      return "Maximum_CpuTime_Exceeded";
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return "Not_Enough_Degrees_Of_Freedom";
    case Ipopt::Invalid_Problem_Definition:
      return "Invalid_Problem_Definition";
    case Ipopt::Invalid_Option:
      return "Invalid_Option";
    case Ipopt::Invalid_Number_Detected:
      return "Invalid_Number_Detected";
    case Ipopt::Insufficient_Memory:
      return "Insufficient_Memory";
    default:
      return "status " + std::to_string(static_cast<int>(status));
  }
}

SolveStatus status_of(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
      return SolveStatus::converged;
    case Ipopt::Infeasible_Problem_Detected:
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return SolveStatus::infeasible;
    case Ipopt::Maximum_Iterations_Exceeded:
      return SolveStatus::iteration_limit;
    default:
      return SolveStatus::failed;
  }
}

}  // namespace

SolveReport solve_ipopt(const Nlp& nlp, const SolveOptions& options, const Progress& progress) {
  static std::mutex one_at_a_time;  // MUMPS before Ipopt 3.14 crashes with two solves in two threads
  const std::lock_guard<std::mutex> lock(one_at_a_time);

  SolveReport report;
  report.solver = "rays (Ipopt)";
  report.variables = nlp.variables();

  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  application->RethrowNonIpoptException(true);
  auto set = application->Options();
  set->SetIntegerValue("print_level", 0);
  set->SetStringValue("sb", "yes");
  set->SetNumericValue("tol", options.tolerance);
  set->SetIntegerValue("max_iter", options.max_iterations);
  set->SetIntegerValue("mumps_pivot_order", 6);  // QAMD: the dense rows ruin the default ordering
  if (nlp.quadratic()) {
    set->SetStringValue("jac_c_constant", "yes");
    set->SetStringValue("hessian_constant", "yes");
  } else if (options.adaptive_barrier) {
    set->SetStringValue("mu_strategy", "adaptive");
    if (options.probing) set->SetStringValue("mu_oracle", "probing");
  }
  set->SetNumericValue("tau_min", options.least_fraction_to_bound);
  if (nlp.strictly_within_bounds()) {
    set->SetNumericValue("bound_relax_factor", 0);
    // The start is within the bounds. On short intervals Ipopt's 1e-2 would push it beyond what pairs must keep.
    set->SetNumericValue("bound_push", 1e-4);
    set->SetNumericValue("slack_bound_push", 1e-4);
    // Measured on SegmentRays: solutions are as good without refinement and with fewer pivots, and take a quarter less time.
    set->SetIntegerValue("min_refinement_steps", 0);
    set->SetNumericValue("mumps_pivtol", 1e-9);
  }
  if (options.barrier_target > 0) set->SetNumericValue("mu_target", options.barrier_target);
  // With "" no options file is read; the default would take ipopt.opt from the current folder.
  if (const auto status = application->Initialize(""); status != Ipopt::Solve_Succeeded)
    throw Error(ErrorCode::internal, "Ipopt could not be started: " + name_of(status) + ".");

  auto* adapter = new Adapter(nlp, progress, report);
  const Ipopt::SmartPtr<Ipopt::TNLP> owner = adapter;
  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(owner);
  if (adapter->interrupted()) progress.check();
  report.solver_status = name_of(status);
  report.status = status_of(status);
  return report;
}

}  // namespace rayrep
