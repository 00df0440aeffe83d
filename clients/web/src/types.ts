// What the services say, as protobuf's JSON has it (proto/exemplar/v1). 64-bit numbers are text.

export interface Vector3 { x: number; y: number; z: number }
export interface Quaternion { x: number; y: number; z: number; w: number }
export interface Pose { position?: Vector3; rotation?: Quaternion }
export interface NamedPose { name: string; pose?: Pose }
export interface Progress { fraction: number; step: string }
export interface PoseSeries { name: string; time_s: number[]; poses: number[]; has_orientation: boolean }
export interface ScalarSeries { names: string[]; time_s: number[]; values: number[] }

export interface SkillInfo { name: string; version: number; versions: number; method: string; target: string; trials: number; learned?: string }
export interface MethodScore { method: string; frechet_m: number; end_error_m: number; frechet_by_trial_m: number[]; chosen: boolean }
export interface ContactPart { object: string; begin_s: number; end_s: number; spread_m: number; touch_measured: boolean }
export interface TrialPart { id: string; source: string; duration_s: number; target_pose?: Pose; notes: string[] }
export interface SkillReport {
  skill: string; version: number; method: string; target: string; duration_s: number;
  trials: TrialPart[]; markers_s: number[]; contact_begin_s?: number; contact_end_s?: number; contact_spread_m: number;
  mean_correlation: number; plain_correlation: number; methods: MethodScore[]; warnings: string[]; notes: string[]; contacts: ContactPart[];
}
export interface Contact { object: string; first: number; last: number; point?: Vector3; touch_measured: boolean }
export interface SkillMotion {
  skill: string; version: number; time_s: number[]; joint_names: string[]; joints: number[]; tool: number[]; hand_open: number[];
  object_names: string[]; objectivity: number[]; sigma_m: number[]; markers_s: number[]; contacts: Contact[]; objects: NamedPose[]; warnings: string[];
}
export interface TrialInfo { id: string; skill: string; source: string; duration_s: number }
export interface Trial { source: string; joints?: ScalarSeries; end_effectors: PoseSeries[]; objects: PoseSeries[] }

export interface PlanSummary {
  duration_s: number; max_position_error_m: number; max_contact_error_m: number; clearance_m: number; clearance_between: string;
  time_stretch: number; warnings: string[];
}
export interface ExecutionFeedback { state: string; time_s: number; duration_s: number; tracking_error_rad: number; touch_n: number }
export interface ExecutionResult {
  state: string; detail: string; plan?: PlanSummary; tracking_error_rad: number; clearance_m: number; contact_error_m?: number;
  touch_max_n: number; tool?: PoseSeries;
}
export interface TeleoperationFeedback {
  state: string; phase: string; detail: string; time_s: number; behind_rad: number; behind_joint: string; tracking_error_rad: number;
  touch_n: number; clearance_m?: number; suit_rate_hz: number;
}
export interface TeleoperationResult {
  state: string; detail: string; duration_s: number; following_s: number; holds: string; blocks: string; clearance_m?: number; touch_max_n: number;
}
export interface RobotStatus {
  state: string; detail: string; speed: number; joint_names: string[]; joints: number[]; state_age_s: number; tool?: Pose;
  objects: { object?: NamedPose; age_s: number }[];
}

export interface RecorderStatus {
  state: string; detail: string; file: string; duration_s: number; messages: string; bytes: string; lost: string; rate_hz: number;
  disk_free_bytes: string;
}
export interface TopicInfo { topic: string; type: string; writers: number; received: string; lost: string; rate_hz: number; bytes_per_s: number }
export interface TopicSample { topic: string; json: string; json_error: string }
export interface SubscribeMessage { samples?: TopicSample[]; missed?: string }

/** What the gateway says of a service: not configured at all, or it does not answer. */
export type Service = "absent" | "silent" | "serving";
export interface Health { status: string; backends: { name: string; address: string; serving: boolean }[] }

// Samples of topics, as their IDL has them.
export interface JointState { source: string; stamp_ns: number | string; names: string[]; positions: number[]; touch_n: number[] }
export interface ObjectPose { name: string; base_T_object: { position_m: number[]; quaternion_xyzw: number[] }; has_orientation: boolean }
export interface PlanSample { skill: string; times_s: number[]; tool_m: number[] }
export interface StatusSample { source: string; program: string; state: string; detail: string; values: { name: string; value: string }[] }

// What the gateway says to pages.
export interface RobotDescription { name: string; base: string; tip: string; urdf: string; joints: string[]; home: Record<string, number>; files: string[] }
export interface ListPose { position: [number, number, number]; quaternion: [number, number, number, number] }
export interface SceneBody { name: string; kind: "obstacle" | "button" | "object"; shape: "box" | "sphere" | "cylinder" | "capsule"; size: number[]; pose: ListPose; offset: ListPose }
export interface SceneDescription { bodies: SceneBody[]; left_out: string[] }
