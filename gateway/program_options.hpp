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
  std::string robot;       ///< folder of the robot, for drawings and ROS 2; empty: none
  std::string scene;       ///< file of the place of work, for the web page; empty: none
  std::string web;         ///< folder of the web page; empty: where it usually is
  std::string recordings;  ///< folder whose recordings Foxglove may play; empty: none
  bool ros2 = false;
  double ros2_rate_hz = 100;
  std::string ros2_robot_from;  ///< ROS 2 topic of joint states; empty: none
  int queue = TopicServerOptions().queue;

  void AddTo(program::Options& options);
  /// The servers behind; those that were not named are not there.
  std::vector<rpc::Backend> Backends(const program::CommonOptions& common) const;
  http::ServerOptions HttpOptions(const program::CommonOptions& common) const;
};

}  // namespace exemplar::gateway
