/* What a ROS 2 node on Cyclone DDS would do, by ROS 2's names, types and qualities of service.
   usage: node DOMAIN listen TOPIC=COUNT...   prints one JSON object a message until each topic has a writer and so many messages of it
                                              have come, or for a minute
          node DOMAIN robot SECONDS           publishes the joint states of a robot at 100 Hz on /robot/joint_states */
#include <dds/dds.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ros2.h"

static void check(dds_return_t code, const char* what) {
  if (code >= 0) return;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-code));
  exit(1);
}

/* rclcpp's default quality, and what latched topics are read with. */
static dds_qos_t* quality(int latched) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, latched ? 1 : 10);
  return qos;
}

static void numbers(const char* name, const double* values, uint32_t count) {
  printf(", \"%s\": [", name);
  for (uint32_t i = 0; i < count; ++i) printf("%s%.17g", i ? ", " : "", values[i]);
  printf("]");
}

static void names(const char* name, char** values, uint32_t count) {
  printf(", \"%s\": [", name);
  for (uint32_t i = 0; i < count; ++i) printf("%s\"%s\"", i ? ", " : "", values[i]);
  printf("]");
}

static void begin(const char* topic, const std_msgs_msg_dds__Header_* header) {
  printf("{\"topic\": \"%s\"", topic);
  if (header != NULL) {
    printf(", \"sec\": %d, \"nanosec\": %u, \"frame\": \"%s\"", header->stamp_.sec_, header->stamp_.nanosec_, header->frame_id_);
  }
}

static void print_state(const char* topic, const void* message) {
  const sensor_msgs_msg_dds__JointState_* state = message;
  begin(topic, &state->header_);
  names("name", state->name_._buffer, state->name_._length);
  numbers("position", state->position_._buffer, state->position_._length);
  numbers("velocity", state->velocity_._buffer, state->velocity_._length);
}

static void print_transforms(const char* topic, const void* message) {
  const tf2_msgs_msg_dds__TFMessage_* transforms = message;
  begin(topic, NULL);
  printf(", \"transforms\": [");
  for (uint32_t i = 0; i < transforms->transforms_._length; ++i) {
    const geometry_msgs_msg_dds__TransformStamped_* t = &transforms->transforms_._buffer[i];
    const double values[7] = {t->transform_.translation_.x_, t->transform_.translation_.y_, t->transform_.translation_.z_,
                              t->transform_.rotation_.x_,    t->transform_.rotation_.y_,    t->transform_.rotation_.z_,
                              t->transform_.rotation_.w_};
    printf("%s{\"parent\": \"%s\", \"child\": \"%s\"", i ? ", " : "", t->header_.frame_id_, t->child_frame_id_);
    numbers("pose", values, 7);
    printf("}");
  }
  printf("]");
}

static void print_pose(const char* topic, const void* message) {
  const geometry_msgs_msg_dds__PoseStamped_* pose = message;
  const double values[7] = {pose->pose_.position_.x_,    pose->pose_.position_.y_,    pose->pose_.position_.z_,
                            pose->pose_.orientation_.x_, pose->pose_.orientation_.y_, pose->pose_.orientation_.z_,
                            pose->pose_.orientation_.w_};
  begin(topic, &pose->header_);
  numbers("pose", values, 7);
}

static void print_text(const char* topic, const void* message) {
  const std_msgs_msg_dds__String_* text = message;
  begin(topic, NULL);
  printf(", \"characters\": %zu, \"urdf\": %s", strlen(text->data_), strstr(text->data_, "<robot") != NULL ? "true" : "false");
}

static void print_clock(const char* topic, const void* message) {
  const rosgraph_msgs_msg_dds__Clock_* now = message;
  begin(topic, NULL);
  printf(", \"sec\": %d, \"nanosec\": %u", now->clock_.sec_, now->clock_.nanosec_);
}

static void print_trajectory(const char* topic, const void* message) {
  const trajectory_msgs_msg_dds__JointTrajectory_* trajectory = message;
  begin(topic, &trajectory->header_);
  names("joint_names", trajectory->joint_names_._buffer, trajectory->joint_names_._length);
  printf(", \"points\": %u", trajectory->points_._length);
  if (trajectory->points_._length > 0) {
    const trajectory_msgs_msg_dds__JointTrajectoryPoint_* last = &trajectory->points_._buffer[trajectory->points_._length - 1];
    numbers("last", last->positions_._buffer, last->positions_._length);
    printf(", \"duration\": %.9f", last->time_from_start_.sec_ + 1e-9 * last->time_from_start_.nanosec_);
  }
}

static void gids(const char* name, const rmw_dds_common_msg_dds__Gid_* values, uint32_t count) {
  printf(", \"%s\": [", name);
  for (uint32_t i = 0; i < count; ++i) {
    printf("%s\"", i ? ", " : "");
    for (int k = 0; k < 16; ++k) printf("%02x", values[i].data_[k]);
    printf("\"");
  }
  printf("]");
}

static void print_nodes(const char* topic, const void* message) {
  const rmw_dds_common_msg_dds__ParticipantEntitiesInfo_* info = message;
  begin(topic, NULL);
  gids("participant", &info->gid_, 1);
  printf(", \"nodes\": [");
  for (uint32_t i = 0; i < info->node_entities_info_seq_._length; ++i) {
    const rmw_dds_common_msg_dds__NodeEntitiesInfo_* node = &info->node_entities_info_seq_._buffer[i];
    printf("%s{\"namespace\": \"%s\", \"name\": \"%s\"", i ? ", " : "", node->node_namespace_, node->node_name_);
    gids("readers", node->reader_gid_seq_._buffer, node->reader_gid_seq_._length);
    gids("writers", node->writer_gid_seq_._buffer, node->writer_gid_seq_._length);
    printf("}");
  }
  printf("]");
}

typedef struct {
  const char* topic;
  const dds_topic_descriptor_t* type;
  int latched;
  void (*print)(const char*, const void*);
} Subscription;

static const Subscription kTopics[] = {
    {"rt/robot_description", &std_msgs_msg_dds__String__desc, 1, print_text},
    {"rt/tf_static", &tf2_msgs_msg_dds__TFMessage__desc, 1, print_transforms},
    {"rt/planned_trajectory", &trajectory_msgs_msg_dds__JointTrajectory__desc, 1, print_trajectory},
    {"ros_discovery_info", &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, 1, print_nodes},
    {"rt/joint_states", &sensor_msgs_msg_dds__JointState__desc, 0, print_state},
    {"rt/joint_command", &sensor_msgs_msg_dds__JointState__desc, 0, print_state},
    {"rt/clock", &rosgraph_msgs_msg_dds__Clock__desc, 0, print_clock},
    {"rt/tf", &tf2_msgs_msg_dds__TFMessage__desc, 0, print_transforms},
    {"rt/objects/target/pose", &geometry_msgs_msg_dds__PoseStamped__desc, 0, print_pose},
};
enum { kCount = sizeof kTopics / sizeof kTopics[0] };

static dds_entity_t topic_of(dds_entity_t participant, const Subscription* subscription) {
  const dds_entity_t topic = dds_create_topic(participant, subscription->type, subscription->topic, NULL, NULL);
  check(topic, subscription->topic);
  return topic;
}

/* As every ROS 2 process does, so that others know that they talk to ROS 2. Returns its writer. */
static dds_entity_t announce(dds_entity_t participant) {
  const Subscription nodes = {"ros_discovery_info", &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, 1, NULL};
  dds_qos_t* qos = quality(1);
  const dds_entity_t writer = dds_create_writer(participant, topic_of(participant, &nodes), qos, NULL);
  check(writer, "writer");
  dds_delete_qos(qos);
  rmw_dds_common_msg_dds__NodeEntitiesInfo_ node;
  memset(&node, 0, sizeof node);
  strcpy(node.node_namespace_, "/");
  strcpy(node.node_name_, "listener");
  rmw_dds_common_msg_dds__ParticipantEntitiesInfo_ info;
  memset(&info, 0, sizeof info);
  dds_guid_t guid;
  check(dds_get_guid(participant, &guid), "guid");
  memcpy(info.gid_.data_, guid.v, sizeof info.gid_.data_);
  info.node_entities_info_seq_._buffer = &node;
  info.node_entities_info_seq_._length = 1;
  check(dds_write(writer, &info), "write");
  return writer;
}

/* What the middleware itself knows of the writers that are heard, and of their participants. */
static void print_matched(const char* topic, dds_entity_t reader) {
  dds_instance_handle_t handles[8];
  const dds_return_t count = dds_get_matched_publications(reader, handles, 8);
  for (dds_return_t i = 0; i < count && i < 8; ++i) {
    dds_builtintopic_endpoint_t* writer = dds_get_matched_publication_data(reader, handles[i]);
    if (writer == NULL) continue;
    printf("{\"topic\": \"matched\", \"of\": \"%s\"", topic);
    gids("writer", (const rmw_dds_common_msg_dds__Gid_*)writer->key.v, 1);
    gids("participant", (const rmw_dds_common_msg_dds__Gid_*)writer->participant_key.v, 1);
    printf("}\n");
    dds_builtintopic_free_endpoint(writer);
  }
}

static void print_participants(dds_entity_t participant) {
  const dds_entity_t reader = dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, NULL, NULL);
  check(reader, "participants");
  void* found[1] = {NULL};
  dds_sample_info_t info[1];
  while (dds_take(reader, found, info, 1, 1) > 0) {
    const dds_builtintopic_participant_t* one = found[0];
    void* data = NULL;
    size_t size = 0;
    if (info[0].valid_data && dds_qget_userdata(one->qos, &data, &size) && size > 0) {
      printf("{\"topic\": \"participant\", \"user_data\": \"%s\"", (const char*)data);
      gids("gid", (const rmw_dds_common_msg_dds__Gid_*)one->key.v, 1);
      printf("}\n");
    }
    dds_free(data);
    check(dds_return_loan(reader, found, 1), "loan");
  }
}

/* Whether all that is wanted has come. */
static int is_heard(const dds_entity_t* readers, const int* wanted, const int* heard) {
  for (int i = 0; i < kCount; ++i) {
    if (wanted[i] < 0) continue;
    dds_subscription_matched_status_t matched;
    check(dds_get_subscription_matched_status(readers[i], &matched), "matched");
    if (matched.current_count == 0 || heard[i] < wanted[i]) return 0;
  }
  return 1;
}

/* Reads "TOPIC=COUNT" into `wanted`, -1 for what is not named. */
static void read_wanted(int count, char** words, int* wanted) {
  for (int i = 0; i < kCount; ++i) wanted[i] = -1;
  for (int k = 0; k < count; ++k) {
    const char* equals = strchr(words[k], '=');
    int found = 0;
    for (int i = 0; i < kCount && equals != NULL; ++i) {
      const size_t length = (size_t)(equals - words[k]);
      if (strlen(kTopics[i].topic) != length || strncmp(kTopics[i].topic, words[k], length) != 0) continue;
      wanted[i] = atoi(equals + 1);
      found = 1;
    }
    if (!found) {
      fprintf(stderr, "%s is not TOPIC=COUNT\n", words[k]);
      exit(2);
    }
  }
}

static void listen(dds_entity_t participant, int count, char** words) {
  dds_entity_t readers[kCount];
  int wanted[kCount];
  int heard[kCount] = {0};
  read_wanted(count, words, wanted);
  (void)announce(participant);
  const dds_entity_t waitset = dds_create_waitset(participant);
  for (int i = 0; i < kCount; ++i) {
    dds_qos_t* qos = quality(kTopics[i].latched);
    readers[i] = dds_create_reader(participant, topic_of(participant, &kTopics[i]), qos, NULL);
    check(readers[i], "reader");
    dds_delete_qos(qos);
    const dds_entity_t condition = dds_create_readcondition(readers[i], DDS_ANY_STATE);
    check(dds_waitset_attach(waitset, condition, i), "waitset");
  }
  const dds_time_t end = dds_time() + DDS_SECS(60);
  while (!is_heard(readers, wanted, heard) && dds_time() < end) {
    (void)dds_waitset_wait(waitset, NULL, 0, DDS_MSECS(100));
    for (int i = 0; i < kCount; ++i) {
      void* message[1] = {NULL};
      dds_sample_info_t info[1];
      while (dds_take(readers[i], message, info, 1, 1) > 0) {
        if (info[0].valid_data) {
          ++heard[i];
          kTopics[i].print(kTopics[i].topic, message[0]);
          printf("}\n");
        }
        check(dds_return_loan(readers[i], message, 1), "loan");
      }
    }
    fflush(stdout);
  }
  for (int i = 0; i < kCount; ++i) print_matched(kTopics[i].topic, readers[i]);
  print_participants(participant);
}

/* Four messages in a hundred are none that a robot can send: more names than positions. */
static void robot(dds_entity_t participant, double seconds) {
  const Subscription states = {"rt/robot/joint_states", &sensor_msgs_msg_dds__JointState__desc, 0, NULL};
  dds_qos_t* qos = quality(0);
  const dds_entity_t writer = dds_create_writer(participant, topic_of(participant, &states), qos, NULL);
  check(writer, "writer");
  dds_delete_qos(qos);
  char* joints[] = {"shoulder", "elbow"};
  for (int i = 0; i < (int)(seconds * 100); ++i) {
    double positions[] = {0.001 * i, -0.5};
    sensor_msgs_msg_dds__JointState_ state;
    memset(&state, 0, sizeof state);
    state.header_.stamp_.sec_ = 1000 + i / 100;
    state.header_.stamp_.nanosec_ = (uint32_t)(i % 100) * 10000000u;
    state.header_.frame_id_ = "";
    state.name_._buffer = joints;
    state.name_._length = 2;
    state.position_._buffer = positions;
    state.position_._length = i % 25 == 24 ? 1 : 2;
    check(dds_write(writer, &state), "write");
    dds_sleepfor(DDS_MSECS(10));
  }
}

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL);
  check(participant, "participant");
  if (strcmp(argv[2], "listen") == 0) {
    listen(participant, argc - 3, argv + 3);
  } else {
    robot(participant, atof(argv[3]));
  }
  dds_delete(participant);
  return 0;
}
