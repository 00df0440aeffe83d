#pragma once
// A server that a test may set up as it wants, with one route.

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "exemplar/http/server.hpp"

namespace exemplar::http {

class ServerTest : public ::testing::Test {
 protected:
  void Make(ServerOptions options = {}) {
    auto made = Server::Create(std::move(options), log_);
    ASSERT_TRUE(made.ok()) << made.error().message;
    server_ = std::move(*made);
    ASSERT_TRUE(
        server_->Route(Method::kGet, "/hello", [](const Request&) { return Answer("hello\n"); })
            .ok());
  }
  int port() const { return server_->port(); }
  std::uint64_t Count(std::atomic<std::uint64_t> Counters::*counter) const {
    return server_->counters().*counter;
  }

  NullLog log_;
  std::unique_ptr<Server> server_;
};

}  // namespace exemplar::http
