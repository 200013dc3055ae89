// Pinocchio's articulated-body algorithm in its own loop, on the chain of chains.py: compiled by peers_rigid.py.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;

struct Chain {
  pin::Model model;
  pin::Data data;
  Eigen::VectorXd q, v, tau;
};

extern "C" __attribute__((visibility("default"))) void* make_chain(int count, double mass, const double* centre,
                                                                  const double* inertia) {
  auto* chain = new Chain;
  const Eigen::Vector3d c(centre[0], centre[1], centre[2]);
  const Eigen::Matrix3d J = Eigen::Vector3d(inertia[0], inertia[1], inertia[2]).asDiagonal();
  pin::JointIndex parent = 0;
  for (int i = 0; i < count; ++i) {
    const pin::SE3 place(Eigen::Matrix3d::Identity(), Eigen::Vector3d(i == 0 ? 0.0 : 1.0, 0, 0));
    const auto name = "j" + std::to_string(i);
    parent = i % 2 == 0 ? chain->model.addJoint(parent, pin::JointModelRZ(), place, name)
                        : chain->model.addJoint(parent, pin::JointModelRY(), place, name);
    chain->model.appendBodyToJoint(parent, pin::Inertia(mass, c, J), pin::SE3::Identity());
  }
  chain->data = pin::Data(chain->model);
  chain->q = 0.1 * Eigen::VectorXd::Random(count);
  chain->v = 0.1 * Eigen::VectorXd::Random(count);
  chain->tau = Eigen::VectorXd::Zero(count);
  return chain;
}

extern "C" __attribute__((visibility("default"))) void repeat(void* given, int count) {
  auto* chain = static_cast<Chain*>(given);
  for (int i = 0; i < count; ++i)
    pin::aba(chain->model, chain->data, chain->q, chain->v, chain->tau, pin::Convention::WORLD);
}

extern "C" __attribute__((visibility("default"))) void drop(void* given) { delete static_cast<Chain*>(given); }
