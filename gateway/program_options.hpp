#pragma once
#include <string>
#include <vector>

#include "exemplar/http/server.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/rpc/server.hpp"
#include "gateway/topic_hub.hpp"
#include "gateway/topic_server.hpp"

namespace exemplar::gateway {

/// The words of exemplar-gateway's command line.
struct ProgramOptions {
  std::string learning;
  std::string trials;
  std::string executor;
  std::string recorder;
  std::vector<std::string> publish;
  std::string http;            ///< HOST:PORT; empty: none
  std::string http_port_file;  ///< gets the port in use
  std::vector<std::string> origins;
  std::string robot;       ///< folder of the robot to draw for Foxglove; empty: none
  std::string recordings;  ///< folder whose recordings Foxglove may play; empty: none
  int queue = TopicServerOptions().queue;

  void AddTo(program::Options& options);
  /// The servers behind; those that were not named are not there.
  std::vector<rpc::Backend> Backends(const program::CommonOptions& common) const;
  http::ServerOptions HttpOptions(const program::CommonOptions& common) const;
};

}  // namespace exemplar::gateway
