use super::value::Value;

/// Effect in this node of a parameter of octomap_server, or of every node of ROS 2, that is not an option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// The map and the topics are the same.
    None,
    /// The map is the same; topics differ as the text says.
    Topics(&'static str),
}

/// Values of parameters that have the same effect in both programs.
#[derive(Clone, Copy)]
enum Same {
    Any,
    False,
    Zero,
    FullDepth,
}

impl Same {
    fn includes(self, value: &Value) -> bool {
        match (self, value) {
            (Self::Any, _) | (_, Value::Nothing) | (Self::False, Value::Bool(false)) => true,
            (Self::Zero, Value::Whole(value)) => *value == 0,
            (Self::Zero, Value::Number(value)) => *value == 0.0,
            (Self::FullDepth, Value::Whole(value)) => *value == 16,
            _ => false,
        }
    }
}

/// Parameters of octomap_server 2 (Humble, Jazzy) and of rclcpp, the values that need no remark, and the effect of the
/// others. A name is that of a parameter or of a group.
const PARAMETERS: [(&str, Same, Effect); 16] = [
    ("filter_speckles", Same::False, Effect::Topics("single occupied voxels are published")),
    ("publish_free_space", Same::False, Effect::Topics("free_cells_vis_array is not published")),
    ("max_depth", Same::FullDepth, Effect::Topics("topics have the full resolution")),
    ("min_x_size", Same::Zero, Effect::Topics("projected_radius sets the size of projected_map")),
    ("min_y_size", Same::Zero, Effect::Topics("projected_radius sets the size of projected_map")),
    ("use_height_map", Same::Any, Effect::None),
    ("height_map", Same::Any, Effect::None),
    ("color_factor", Same::Any, Effect::None),
    ("color", Same::Any, Effect::None),
    ("color_free", Same::Any, Effect::None),
    // All topics are latched and skipped without subscribers, maps are compressed, and projected_map is complete.
    ("latch", Same::Any, Effect::None),
    ("compress_map", Same::Any, Effect::None),
    ("incremental_2D_projection", Same::Any, Effect::None),
    // The node uses the stamps of messages.
    ("use_sim_time", Same::Any, Effect::None),
    ("start_type_description_service", Same::Any, Effect::None),
    ("qos_overrides", Same::Any, Effect::Topics("the quality of service is fixed")),
];

/// Returns the effect of a parameter with a value, or `None` if the parameter is not of octomap_server.
pub fn effect_of(name: &str, value: &Value) -> Option<Effect> {
    let group = name.split('.').next().unwrap_or_default();
    let (_, same, effect) = PARAMETERS.iter().find(|(known, ..)| *known == name || *known == group)?;
    let is_same = same.includes(value) && group != "qos_overrides";
    Some(if is_same { Effect::None } else { effect.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_change_topics_have_a_remark() {
        let effect = |name, value| effect_of(name, &value);
        assert_eq!(effect("filter_speckles", Value::Bool(false)), Some(Effect::None));
        // A value of the wrong type could be meant as true.
        assert!(matches!(effect("filter_speckles", Value::Text("yes".into())), Some(Effect::Topics(_))));
        assert_eq!(effect("color.r", Value::Whole(1)), Some(Effect::None));
        assert_eq!(effect("max_depth", Value::Whole(16)), Some(Effect::None));
        assert!(matches!(effect("max_depth", Value::Whole(14)), Some(Effect::Topics(_))));
        assert!(matches!(effect("min_x_size", Value::Number(5.0)), Some(Effect::Topics(_))));
        assert!(matches!(effect("qos_overrides./tf.depth", Value::Whole(1)), Some(Effect::Topics(_))));
        for other in ["", "colour", "ground", "filter_ground", "resolution", "sensor_model.hit"] {
            assert_eq!(effect(other, Value::Whole(0)), None, "{other}");
        }
    }
}
