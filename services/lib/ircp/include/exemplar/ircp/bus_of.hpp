#pragma once
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "exemplar/ircp/bus.hpp"

namespace exemplar::ircp {

/// Implements the ports of every sample type by two templates of Derived:
///   template <class Sample> Result<std::unique_ptr<Writer<Sample>>> OpenWriter(topic, source);
///   template <class Sample> Result<std::unique_ptr<Reader>> OpenReader(topic, callback);
/// Base is Bus or derives from it.
template <class Derived, class Base = Bus>
class BusOf : public Base {
 public:
// NOLINTBEGIN(bugprone-macro-parentheses): a type cannot stand in parentheses
#define EXEMPLAR_IRCP_PORT(Sample)                                                               \
  Result<std::unique_ptr<Writer<Sample>>> DoMakeWriter(                                          \
      std::type_identity<Sample>, const std::string& topic, const std::string& source) final {   \
    return static_cast<Derived*>(this)->template OpenWriter<Sample>(topic, source);              \
  }                                                                                              \
  Result<std::unique_ptr<Reader>> DoMakeReader(                                                  \
      std::type_identity<Sample>, const std::string& topic, Callback<Sample> callback) final {   \
    return static_cast<Derived*>(this)->template OpenReader<Sample>(topic, std::move(callback)); \
  }
  EXEMPLAR_IRCP_PORT(SuitSample)
  EXEMPLAR_IRCP_PORT(EndEffectorSample)
  EXEMPLAR_IRCP_PORT(TactileSample)
  EXEMPLAR_IRCP_PORT(CameraSample)
  EXEMPLAR_IRCP_PORT(ObjectSample)
  EXEMPLAR_IRCP_PORT(JointStateSample)
  EXEMPLAR_IRCP_PORT(JointCommandSample)
  EXEMPLAR_IRCP_PORT(PlanSample)
  EXEMPLAR_IRCP_PORT(CommandSample)
  EXEMPLAR_IRCP_PORT(StatusSample)
  EXEMPLAR_IRCP_PORT(SafetySample)
  EXEMPLAR_IRCP_PORT(ClockSample)
#undef EXEMPLAR_IRCP_PORT
  // NOLINTEND(bugprone-macro-parentheses)
};

}  // namespace exemplar::ircp
