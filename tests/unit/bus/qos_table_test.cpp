#include "exemplar/bus/qos_table.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

namespace exemplar::bus {
namespace {

std::string MarkdownRow(const TopicQos& row) {
  std::ostringstream line;
  line << "| `" << row.topic << "` | " << row.type << " | " << row.rate << " | "
       << (row.reliable ? "reliable" : "best effort") << " | " << row.depth << " | "
       << row.max_instances << " | " << row.heartbeat.count() << " ms | "
       << (row.transient_local ? "transient local" : "volatile") << " | ";
  if (row.deadline.count() == 0) {
    line << "none |";
  } else {
    line << row.deadline.count() << " ms |";
  }
  return line.str();
}

TEST(QosTableTest, StandsInTheDocumentation) {
  std::ifstream file(std::string(EXEMPLAR_SOURCE_DIR) + "/docs/topics.md");
  ASSERT_TRUE(file);
  std::set<std::string> documented;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("| `")) documented.insert(line);
  }
  std::set<std::string> coded;
  for (const TopicQos& row : QosTable()) coded.insert(MarkdownRow(row));
  EXPECT_EQ(documented, coded);
}

TEST(QosTableTest, EveryRowIsUsable) {
  for (const TopicQos& row : QosTable()) {
    EXPECT_EQ(&QosOfType(row.type), &row);
    EXPECT_GT(row.depth, 0) << row.topic;
    EXPECT_GT(row.max_instances, 0) << row.topic;
    EXPECT_GE(row.heartbeat.count(), 20) << row.topic;
    EXPECT_LE(row.heartbeat.count(), 50) << row.topic;
  }
}

}  // namespace
}  // namespace exemplar::bus
